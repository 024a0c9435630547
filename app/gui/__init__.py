"""The parts of the window: each does one job for `app.window`, none imports it."""
