"""Editing the selected light's outline in the picture: what is grabbed, clicked and chosen.

Grips are invisible buttons over the picture, submitted with the nearest to the
pointer first, so that this one is grabbed where several lie on each other.
Everything done is an edit of `app.lights` and one step of the history.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from imgui_bundle import ImVec2, imgui

from app import contours, edits, lights, planes
from app.editor import Editor, Selection
from app.gui.grips import Grip, grips_of, is_crowded, nearest_grip, sorted_by_distance
from app.gui.messages import Messages
from app.gui.overlays import HANDLE, Canvas, Sight
from app.gui.shortcuts import key_of
from app.scene import ANCHOR_KINDS, AnchorKind, AreaLight, BezierContour, SceneError, Vec2


@dataclass(frozen=True, slots=True)
class Drag:
    """What is under the pointer: the light before, the item, where in it the pointer took hold.

    A middle of a segment is dragged as the vertex that was added there, and with
    Shift an anchor as a handle that lay on it; ``item`` is what was pressed,
    ``grip`` what moves.
    """

    light: int
    before: AreaLight
    item: str
    grip: Grip
    offset: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Spot:
    """A place on the outline: contour, segment, and the parameter along it."""

    contour: int
    segment: int
    along: float


class OutlineTool:
    """Turns what is done to the selected light's outline into edits.

    Parameters
    ----------
    messages : Messages
        Gets what cannot be done.

    Attributes
    ----------
    shown : tuple of (contour, point)
        The vertices drawn last.
    """

    def __init__(self, messages: Messages) -> None:
        self._messages = messages
        self._drag: Drag | None = None
        self._was_free = False
        self.shown: tuple[tuple[int, int], ...] = ()
        self._asked: Spot | None = None

    @property
    def is_dragging(self) -> bool:
        return self._drag is not None

    def let_go(self) -> None:
        """Forget the drag: what was grabbed is no longer there."""
        self._drag = None

    # --- one frame ------------------------------------------------------------

    def submit(self, editor: Editor, sight: Sight) -> None:
        """Submit the grips of the selected light, their menus, and the drag under way."""
        light = editor.selected_light
        if light is None:
            self._drag = None
            return
        held = self._drag.item if self._drag is not None else ""
        grips = grips_of(sight, light, editor.selection.vertex, held)
        mouse = imgui.get_io().mouse_pos
        for grip in sorted_by_distance(grips, mouse.x, mouse.y):
            if self._button(grip, sight.unit):
                self._begin(editor, light, grip)
            if grip.what != "edge":
                self._grip_menu(editor, grip)
            elif imgui.is_item_hovered() and imgui.is_mouse_released(imgui.MouseButton_.right):
                self.ask_about(Spot(grip.contour, grip.index, 0.5))
        self._follow(editor, sight)

    def draw(self, editor: Editor, sight: Sight, hidden: frozenset[tuple[int, int]]) -> None:
        """Draw the grips of the selected light; ``hidden`` vertices are dim."""
        light, chosen = editor.selected_light, editor.selection.vertex
        if light is None:
            return
        held = self._drag.item if self._drag is not None else ""
        canvas = Canvas(imgui.get_window_draw_list(), sight, is_crowded(light))
        grips = grips_of(sight, light, chosen, held)
        self.shown = tuple((g.contour, g.index) for g in grips if g.what == "vertex")
        mouse = imgui.get_io().mouse_pos
        near = nearest_grip(grips, mouse.x, mouse.y, sight.unit * HANDLE)
        if self._drag is not None:
            moving = self._drag.grip.name
            near = next((grip for grip in grips if grip.name == moving), near)
        for grip in grips:
            if grip.what == "edge" and grip.name != held:
                canvas.middle(grip.at, near=grip is near)
        for grip in grips:
            if grip.what == "handle":
                canvas.handle(grip.anchor, grip.at, near=grip is near)
        for grip in grips:
            if grip.what == "vertex":
                vertex = (grip.contour, grip.index)
                canvas.vertex(
                    grip.at, grip.kind, near=grip is near, chosen=vertex == chosen,
                    hidden=vertex in hidden,
                )  # fmt: skip

    def _button(self, grip: Grip, unit: float) -> bool:
        """Submit an invisible button around a grip and tell whether it was just pressed."""
        half = unit * HANDLE
        imgui.set_cursor_screen_pos(ImVec2(grip.at[0] - half, grip.at[1] - half))
        buttons = imgui.ButtonFlags_.mouse_button_left | imgui.ButtonFlags_.mouse_button_right
        imgui.invisible_button(grip.name, ImVec2(2.0 * half, 2.0 * half), buttons)
        if imgui.is_item_hovered() or imgui.is_item_active():
            imgui.set_mouse_cursor(imgui.MouseCursor_.hand)
        return imgui.is_item_activated() and imgui.is_mouse_down(imgui.MouseButton_.left)

    # --- drags ------------------------------------------------------------------

    def _begin(self, editor: Editor, light: AreaLight, grip: Grip) -> None:
        index, contour = editor.selection.index, light.outline.contours[grip.contour]
        word, vertex, item = lights.word_for_vertex(contour), grip.index, grip.name
        name = {"vertex": f"Move {word} of", "handle": "Move handle of", "edge": f"Add {word} to"}
        pulled = None
        if grip.what == "vertex" and imgui.get_io().key_shift:
            pulled = contours.handle_to_pull(contour, grip.index)
        if pulled is not None:
            grip = Grip("handle", grip.contour, pulled[0], grip.at, pulled[1])
        editor.begin(f"{name[grip.what]} '{light.name}'")
        if grip.what == "edge":
            light = lights.add_vertex(light, grip.contour, grip.index)
            editor.update(edits.replace_light(editor.scene, index, light))
            vertex = grip.index + 1
            grip = Grip("vertex", grip.contour, vertex, grip.at)
        elif isinstance(contour, BezierContour) and grip.what == "handle":
            vertex = contours.anchor_of(contour, grip.index, grip.which)
        editor.selection = Selection.light(index, (grip.contour, vertex))
        mouse = imgui.get_io().mouse_pos
        offset = (grip.at[0] - mouse.x, grip.at[1] - mouse.y)
        self._drag, self._was_free = Drag(index, light, item, grip, offset), False

    def _follow(self, editor: Editor, sight: Sight) -> None:
        """Let what is grabbed follow the pointer on the light's plane; Alt frees a handle."""
        drag = self._drag
        if drag is None:
            return
        if not editor.is_dragging or not imgui.is_mouse_down(imgui.MouseButton_.left):
            self._drag = None
            return
        io = imgui.get_io()
        if not (io.mouse_delta.x or io.mouse_delta.y or io.key_alt != self._was_free):
            return
        self._was_free = io.key_alt
        x, y = io.mouse_pos.x + drag.offset[0], io.mouse_pos.y + drag.offset[1]
        to = sight.plane_point(drag.before.plane, x, y)
        if to is not None:
            moved = _moved(drag.before, drag.grip, to, free=io.key_alt)
            editor.update(edits.replace_light(editor.scene, drag.light, moved))

    # --- places on the outline ------------------------------------------------------

    def spot_at(self, editor: Editor, sight: Sight, x: float, y: float) -> Spot | None:
        """Return the place of the selected light's outline at the pointer, None if it is not."""
        light = editor.selected_light
        under = sight.plane_point(light.plane, x, y) if light is not None else None
        if light is None or under is None:
            return None
        spot = Spot(*lights.nearest_edge(light, under))
        place = lights.point_along(light, spot.contour, spot.segment, spot.along)
        at = sight.project(planes.point_on(light.plane, place))
        if at is None or max(abs(at[0] - x), abs(at[1] - y)) > sight.unit * HANDLE:
            return None
        return spot

    def insert(self, editor: Editor, spot: Spot) -> None:
        """Add a vertex at a place on the selected light's outline, and select it."""
        light = editor.selected_light
        if light is None or not 0.0 < spot.along < 1.0:
            return
        index = editor.selection.index
        wider = lights.add_vertex(light, spot.contour, spot.segment, spot.along)
        word = lights.word_for_vertex(light.outline.contours[spot.contour])
        editor.apply(
            f"Add {word} to '{light.name}'", edits.replace_light(editor.scene, index, wider)
        )
        editor.selection = Selection.light(index, (spot.contour, spot.segment + 1))

    def ask_about(self, spot: Spot) -> None:
        """Open the menu of a place on the outline."""
        self._asked = spot
        imgui.open_popup("segment")

    def segment_menu(self, editor: Editor) -> None:
        """Draw the menu that `ask_about` opens."""
        spot, light = self._asked, editor.selected_light
        if not imgui.begin_popup("segment"):
            return
        if spot is not None and light is not None and _exists(light, spot):
            contour, segment = spot.contour, spot.segment
            straight = bool(contours.straight_segments(light.outline.contours[contour])[segment])
            if imgui.menu_item_simple("Add point here", "Double-click"):
                self.insert(editor, spot)
            if imgui.menu_item_simple("Make line", "", straight, not straight):
                self._reshape(
                    editor, "Straighten", lambda x: lights.straighten(x, contour, segment)
                )
            if imgui.menu_item_simple("Make curve", "", not straight, straight):
                self._reshape(editor, "Bend", lambda x: lights.bend(x, contour, segment))
            self._contour_items(editor, light, contour)
        imgui.end_popup()

    # --- menus and keys -----------------------------------------------------------------

    def _grip_menu(self, editor: Editor, grip: Grip) -> None:
        """Draw the menu of a vertex or handle that was clicked with the right button."""
        if not imgui.begin_popup_context_item(f"menu of {grip.name}"):
            return
        light = editor.selected_light
        if light is not None:
            contour = light.outline.contours[grip.contour]
            if grip.what == "handle" and isinstance(contour, BezierContour):
                vertex = grip.contour, contours.anchor_of(contour, grip.index, grip.which)
                self._kind_items(editor, vertex, grip.kind)
                imgui.separator()
                if imgui.menu_item_simple("Retract handle"):
                    where = grip.contour, grip.index, grip.which
                    self._reshape(
                        editor, "Retract handle of", lambda x: lights.retract_handle(x, *where)
                    )
            else:
                self._vertex_items(editor, light, (grip.contour, grip.index), grip.kind)
        imgui.end_popup()

    def _vertex_items(
        self, editor: Editor, light: AreaLight, vertex: tuple[int, int], kind: AnchorKind
    ) -> None:
        word = lights.word_for_vertex(light.outline.contours[vertex[0]])
        self._kind_items(editor, vertex, kind)
        imgui.separator()
        other = editor.selection.vertex
        pair = other is not None and other[0] == vertex[0] and other[1] != vertex[1]
        if imgui.menu_item_simple("Split outline from selected point", "", False, pair):
            first = other[1] if other is not None else 0
            self._reshape(
                editor, "Split", lambda x: lights.split_contour(x, vertex[0], first, vertex[1])
            )
        if imgui.menu_item_simple(f"Remove {word}", key_of("remove")):
            self._reshape(editor, f"Remove {word} of", lambda x: lights.remove_vertex(x, vertex))
        self._contour_items(editor, light, vertex[0])

    def _kind_items(self, editor: Editor, vertex: tuple[int, int], now: AnchorKind) -> None:
        for kind in ANCHOR_KINDS:
            if imgui.menu_item_simple(kind.capitalize(), key_of(kind), kind == now):
                self._set_kind(editor, vertex, kind)

    def _contour_items(self, editor: Editor, light: AreaLight, contour: int) -> None:
        """Draw the items that concern a whole contour."""
        imgui.separator()
        curved = isinstance(light.outline.contours[contour], BezierContour)
        if imgui.menu_item_simple("Reverse outline", key_of("reverse")):
            self._reverse(editor, light, contour)
        if not curved and imgui.menu_item_simple("Convert to curves"):
            self._reshape(editor, "Convert", lambda x: lights.to_bezier(x, contour))
        if curved and imgui.begin_menu("Convert to polygon"):
            for name, fineness in lights.FINENESS.items():
                if imgui.menu_item_simple(f"{name.capitalize()} ({100.0 * fineness:g} %)"):
                    self._convert(editor, contour, fineness)
            imgui.end_menu()
        several = len(light.outline.contours) > 1
        if several and imgui.menu_item_simple("Remove outline"):
            self._reshape(editor, "Remove outline of", lambda x: lights.remove_contour(x, contour))

    def _convert(self, editor: Editor, contour: int, fineness: float) -> None:
        self._reshape(editor, "Convert", lambda x: lights.to_polygon(x, fineness, contour))

    def set_kind(self, editor: Editor, kind: AnchorKind) -> None:
        """Make the selected vertex a corner, smooth or symmetric."""
        if editor.selection.vertex is not None:
            self._set_kind(editor, editor.selection.vertex, kind)

    def _set_kind(self, editor: Editor, vertex: tuple[int, int], kind: AnchorKind) -> None:
        name = {"corner": "Make corner of", "smooth": "Smooth", "symmetric": "Make symmetric"}[kind]
        self._reshape(editor, name, lambda x: lights.set_kind(x, vertex, kind))

    def straighten(self, editor: Editor) -> None:
        """Make a line of the segment that begins at the selected vertex."""
        self._at_selected(editor, "Straighten", lights.straighten)

    def bend(self, editor: Editor) -> None:
        """Make a curve of the segment that begins at the selected vertex."""
        self._at_selected(editor, "Bend", lights.bend)

    def reverse(self, editor: Editor) -> None:
        """Let the contour of the selected vertex, or all of the light, wind the other way."""
        light, vertex = editor.selected_light, editor.selection.vertex
        if light is None:
            return
        chosen = [vertex[0]] if vertex is not None else range(len(light.outline.contours))
        self._reverse(editor, light, *chosen)

    def _reverse(self, editor: Editor, light: AreaLight, *chosen: int) -> None:
        """Let contours wind the other way; the selected vertex stays the same place."""
        old = editor.selection.vertex

        def turned(light: AreaLight) -> AreaLight:
            for contour in chosen:
                light = lights.reverse_contour(light, contour)
            return light

        self._reshape(editor, "Reverse", turned)
        if old is not None and old[0] in chosen:
            count = contours.size_of(light.outline.contours[old[0]])
            place = (old[0], -old[1] % count)
            editor.selection = Selection.light(editor.selection.index, place)

    def _at_selected(
        self, editor: Editor, name: str, change: Callable[[AreaLight, int, int], AreaLight]
    ) -> None:
        vertex = editor.selection.vertex
        if vertex is not None:
            self._reshape(editor, name, lambda light: change(light, *vertex))

    def _reshape(self, editor: Editor, name: str, change: Callable[[AreaLight], AreaLight]) -> None:
        """Change the selected light, as one step; what cannot be done becomes a message."""
        light = editor.selected_light
        if light is None:
            return
        try:
            changed = change(light)
        except SceneError as failure:
            self._messages.failure(str(failure))
            return
        scene = edits.replace_light(editor.scene, editor.selection.index, changed)
        editor.apply(f"{name} '{light.name}'", scene)


def _moved(light: AreaLight, grip: Grip, to: Vec2, *, free: bool) -> AreaLight:
    """Return the light with a grip at plane coordinates ``to``."""
    if grip.what == "handle":
        return lights.move_handle(light, grip.contour, grip.index, grip.which, to, free=free)
    return lights.move_vertex(light, (grip.contour, grip.index), to)


def _exists(light: AreaLight, spot: Spot) -> bool:
    own = light.outline.contours
    return spot.contour < len(own) and spot.segment < contours.size_of(own[spot.contour])
