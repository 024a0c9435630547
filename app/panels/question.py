"""The question about unsaved edits."""

from __future__ import annotations

from imgui_bundle import imgui

from app.gui.documents import Answer
from app.panels.widgets import begin_modal, button

_TITLE = "Unsaved changes"


def unsaved_question(text: str) -> Answer | None:
    """Ask, over everything else; return the answer in the frame in which it is given."""
    if not imgui.is_popup_open(_TITLE):
        imgui.open_popup(_TITLE)
    if not begin_modal(_TITLE):
        return None
    imgui.text(text)
    imgui.spacing()
    width = 7.0 * imgui.get_font_size()
    answer: Answer | None = None
    if button("Save###save first", width=width):
        answer = "save"
    imgui.same_line()
    if button("Discard###discard", width=width):
        answer = "discard"
    imgui.same_line()
    if button("Cancel###cancel", width=width):
        answer = "cancel"
    if answer is not None:
        imgui.close_current_popup()
    imgui.end_popup()
    return answer
