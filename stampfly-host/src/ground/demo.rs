//! The page with the whole simulation inside.
