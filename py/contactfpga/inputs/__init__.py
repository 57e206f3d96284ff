"""Values and files from outside, refused with a sentence if unreadable."""
