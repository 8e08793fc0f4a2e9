//! See the workspace architecture page.
