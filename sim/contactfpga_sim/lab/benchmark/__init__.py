"""Scenes with truth and forces per cell as files, a scorer that needs numpy alone, and our own results and rivals'."""
