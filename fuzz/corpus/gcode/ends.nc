g0x1y2
g1 f5 x 1 . 5
	X0µ (µm)
