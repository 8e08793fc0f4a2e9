//! No count is lost over ten million edges; `cargo xtask figures edges` does the same over ten thousand million.

#[allow(dead_code, reason = "the example's main is not used here")]
#[path = "../examples/edges.rs"]
mod edges;

#[test]
fn no_count_is_lost_in_ten_million_edges_at_5_and_at_50_mm_s() {
    for mm_s in [5.0, 50.0] {
        let all = edges::tally(mm_s, 5_000_000);
        assert_eq!((all.lost, all.illegal, all.edges), (0, 0, 5_000_000), "{mm_s} mm/s");
        assert!(all.turns.iter().flatten().all(|&turns| turns > 1000), "{mm_s} mm/s: {:?}", all.turns);
        assert!(all.filtered > 500_000, "{mm_s} mm/s: {}", all.filtered);
    }
}
