"""What measuring commands and the window's panel have in common: entries, errors, times."""
