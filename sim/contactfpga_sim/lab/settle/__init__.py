"""Where a precharged scan breaks: coupling, slow contacts, long lines, many columns, faulty diodes."""
