"""Cost of labelling over the seam of a closed sheet."""
