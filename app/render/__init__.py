"""Shots to pictures, with OpenGL 4.1. Knows neither window nor GUI; start at `renderer`."""
