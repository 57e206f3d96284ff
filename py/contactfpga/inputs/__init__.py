"""Values and files from outside, refused with a sentence where they cannot be read."""
