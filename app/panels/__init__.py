"""The docked panels: functions from a value to a new value, drawn with Dear ImGui.

A panel keeps no state, knows no GL and no renderer, and raises only after it
has drawn everything, so a value that a scene cannot hold (`SceneError`) never
leaves Dear ImGui half way. Degrees, sRGB pickers and slider values exist only
here.
"""
