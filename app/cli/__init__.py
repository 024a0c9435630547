"""The command line: one module per command, `main` puts them together.

A command takes strings from outside, turns them into checked values, and
leaves the work to `app.render`. GPU libraries are imported only once the input
has been found good, so that ``--help`` and bad input answer at once.
"""
