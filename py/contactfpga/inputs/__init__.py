"""Values and files from outside, refused with one sentence if invalid."""
