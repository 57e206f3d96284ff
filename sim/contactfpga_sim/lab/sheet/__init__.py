"""The sheet of docs/sheet.md, as its command draws it."""
