"""What must hold of every technique, and where it is hardest: sweeps through the extreme.

`lights`, `clouds` and `paths` make lights and points, as functions of numbers in [0, 1), and
`sweeps` names them, so that ``ltc-viewer stability`` and the property tests draw from the same.
`definitions` evaluates what a technique should give in float64, `bounds` is the table of how far
float32 may be off, with reasons, and of the exceptions, with causes. `compare` holds one against
the other, `measure` counts.
"""
