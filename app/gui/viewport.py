"""The picture in the window, and everything in it that can be grabbed.

One frame goes: pointer and keys change the scene through the editor, the
renderer adds a sample of that scene, the picture and the outlines and handles
over it are drawn. So what lies over the picture always belongs to it.
"""

from __future__ import annotations

import contextlib
import math
import time
from dataclasses import dataclass, replace

import numpy as np
from imgui_bundle import ImVec2, imgui
from imgui_bundle.imguizmo import im_guizmo as gizmo

from app import camera_control as control
from app import edits, lights, planes
from app.editor import NOTHING, Editor, Selection
from app.errors import InputError
from app.gui import theme
from app.gui.live_picture import LivePicture, Reporter
from app.gui.overlays import HANDLE, Canvas, View, help_line, is_near, middles_of
from app.gui.placement import box_corners, moved_by, name_of, pose_of, sphere_around
from app.gui.shortcuts import key_of
from app.render.renderer import Hit, Renderer
from app.scene import AreaLight, Camera, RenderSettings, Scene, SceneError, Shot, Vec2
from app.vectors import add, length, subtract

STILL_SAMPLES = 32
"""How many samples per pixel a still picture gathers unless told otherwise."""
UNDER_STATUS_BAR = 1
"""Points by which hello_imgui's status bar covers the docked windows."""

CROWD = 16
"""Corners from which on they are drawn smaller."""
MOST_HANDLES = 400
"""Corners beyond this number get no handles: they would hide the light."""
MOST_ASKED = 64
"""How many corners of a light are asked whether they are behind something."""
ASKING = 0.004
"""Seconds per frame for asking."""


@dataclass(frozen=True, slots=True)
class CornerDrag:
    """A corner under the pointer: which, and where in it the pointer took hold, in points."""

    light: int
    vertex: tuple[int, int]
    grip: tuple[float, float]


@dataclass(frozen=True, slots=True)
class GizmoDrag:
    """A gizmo in use: the scene and the matrix it began with."""

    scene: Scene
    selection: Selection
    matrix: np.ndarray


class Viewport:
    """Draws the picture and turns what is done to it into edits.

    Parameters
    ----------
    renderer : Renderer
        Picks, and renders what `LivePicture` asks for.
    reporter : Reporter
        Gets the failures of rendering and editing.
    """

    def __init__(self, renderer: Renderer, reporter: Reporter) -> None:
        self.settings = RenderSettings(samples=STILL_SAMPLES)
        self.tool = "move"
        self.show_overlays = True
        self.help = ""
        self.view = View(0.0, 0.0, 1.0, 1.0, (1, 1))
        self.picture = LivePicture(renderer, reporter)
        self._renderer = renderer
        self._reporter = reporter
        self._corner: CornerDrag | None = None
        self._gizmo: GizmoDrag | None = None
        self._gizmo_hovered = False
        self._unit = 1.0
        self._moved = 0.0
        self._hidden: frozenset[tuple[int, int]] = frozenset()
        self._unasked: list[tuple[tuple[int, int], Vec2]] = []
        self._is_asking = False
        self._occlusion_of: tuple[Shot | None, int] | None = None
        self._hovered_light: int | None = None
        self._asked: Hit | None = None

    # --- the outside ----------------------------------------------------------

    @property
    def is_busy(self) -> bool:
        """Whether a gizmo is in use, which Dear ImGui does not count as an active item."""
        return self._gizmo is not None

    @property
    def is_settled(self) -> bool:
        """Whether the picture has all its samples at full size and shows the present scene."""
        return self.picture.is_settled(self.view.pixels)

    @property
    def is_idle(self) -> bool:
        """Whether nothing is left to do until the user does something."""
        return self.is_settled and not self._is_asking

    def frame(self, editor: Editor) -> None:
        """Turn the camera's attention to what is selected, or to the whole scene."""
        sphere = sphere_around(editor.scene, editor.selection)
        if sphere is None:
            return
        aspect = max(self.view.width / self.view.height, control.LEAST_ASPECT)
        editor.look(control.frame(editor.scene.camera, *sphere, aspect))

    def take(self, tool: str) -> None:
        """Take the tool that moves or the one that rotates: "move", "rotate"."""
        self.tool = tool

    def toggle_overlays(self) -> None:
        """Show or hide what lies over the picture: outlines, handles, help."""
        self.show_overlays = not self.show_overlays

    def draw(self, editor: Editor) -> None:
        """Draw one frame into the current Dear ImGui window."""
        self._place()
        if self.show_overlays and self._gizmo is None:
            self._handles(editor)
        self._canvas(editor)
        scene = editor.scene
        self.picture.render(scene, self.camera_of(scene), self.settings, self.view.pixels)
        self.picture.draw(self.view)
        self._is_asking = False
        if self.show_overlays:
            self._overlays(editor)
            self._manipulate(editor)
            help_line(self.view, self.help)

    def camera_of(self, scene: Scene) -> Camera:
        """Return the camera that the picture is seen with."""
        return control.widened(scene.camera, self.view.width / self.view.height)

    # --- where -----------------------------------------------------------------

    def _place(self) -> None:
        corner, room = imgui.get_cursor_screen_pos(), imgui.get_content_region_avail()
        self._unit = imgui.get_font_size() / theme.FONT_SIZE
        ratio = imgui.get_io().display_framebuffer_scale
        x, y = math.ceil(corner.x), math.ceil(corner.y)
        width = max(math.floor(corner.x + room.x) - x, 16)
        height = max(math.floor(corner.y + room.y) - y - UNDER_STATUS_BAR, 16)
        pixels = (max(round(width * ratio.x), 1), max(round(height * ratio.y), 1))
        self.view = View(x, y, width, height, pixels)

    # --- pointer and camera ------------------------------------------------------

    def _canvas(self, editor: Editor) -> None:
        view = self.view
        size = ImVec2(view.width, view.height)
        imgui.set_cursor_screen_pos(ImVec2(view.x, view.y))
        if self._gizmo_hovered and not imgui.is_any_item_active():
            imgui.dummy(size)
            return
        imgui.set_next_item_allow_overlap()
        buttons = (
            imgui.ButtonFlags_.mouse_button_left
            | imgui.ButtonFlags_.mouse_button_middle
            | imgui.ButtonFlags_.mouse_button_right
        )
        imgui.invisible_button("viewport", size, buttons)
        hovered, active = imgui.is_item_hovered(), imgui.is_item_active()
        io = imgui.get_io()
        if imgui.is_item_activated():
            self._moved = 0.0
        if active:
            dx, dy = io.mouse_delta.x, io.mouse_delta.y
            self._moved += abs(dx) + abs(dy)
            if self._moved > io.mouse_drag_threshold and (dx or dy):
                self._navigate(editor, dx, dy)
        if hovered and io.mouse_wheel and not imgui.is_any_item_active():
            editor.look(control.dolly(editor.scene.camera, io.mouse_wheel))
        if imgui.is_item_deactivated() and self._moved <= io.mouse_drag_threshold:
            if imgui.is_mouse_released(imgui.MouseButton_.left):
                self._select(editor, io.mouse_pos.x, io.mouse_pos.y)
            elif imgui.is_mouse_released(imgui.MouseButton_.right):
                self._asked = self._hit(io.mouse_pos.x, io.mouse_pos.y)
                if self._asked is not None:
                    imgui.open_popup("place")
        self._place_menu(editor)
        if hovered and imgui.is_mouse_double_clicked(imgui.MouseButton_.left):
            self._split_edge(editor, io.mouse_pos.x, io.mouse_pos.y)
        self._hover(editor.scene, hovered and not active)

    def _navigate(self, editor: Editor, dx: float, dy: float) -> None:
        """Left or middle drag orbits, right or Shift drag pans, Ctrl+middle drag dollies."""
        io, camera = imgui.get_io(), editor.scene.camera
        right = imgui.is_mouse_down(imgui.MouseButton_.right)
        middle = imgui.is_mouse_down(imgui.MouseButton_.middle)
        if right or io.key_shift:
            panned = control.pan(self.camera_of(editor.scene), dx, dy, self.view.height)
            editor.look(replace(panned, fov_y=camera.fov_y))
        elif middle and io.key_ctrl:
            editor.look(control.dolly(camera, -0.05 * dy))
        else:
            turn = np.pi / self.view.height
            editor.look(control.orbit(camera, -dx * turn, dy * turn))

    def _hit(self, x: float, y: float) -> Hit | None:
        """Return what the picture shows at screen coordinates."""
        view, shot = self.view, self.picture.shot
        if shot is None or self.picture.has_failed or not view.contains(x, y):
            return None
        hit = self._renderer.pick(
            (x - view.x) / view.width * shot.width, (y - view.y) / view.height * shot.height
        )
        self._renderer.ctx.screen.use()
        return hit

    def _select(self, editor: Editor, x: float, y: float) -> None:
        if self._edge_at(editor, x, y) is not None:
            return
        hit = self._hit(x, y)
        if hit is None:
            editor.selection = NOTHING
        elif hit.kind == "light":
            editor.selection = Selection.light(hit.index)
        else:
            editor.selection = Selection.object(hit.index)

    def _place_menu(self, editor: Editor) -> None:
        """Offer what can be done with the place that was clicked with the right button."""
        hit, light = self._asked, editor.selected_light
        if hit is None or not imgui.begin_popup("place"):
            return
        if light is not None and imgui.menu_item_simple(f"Aim '{light.name}' here###aim here"):
            try:
                aimed = lights.aim(light, hit.position_ws)
                scene = edits.replace_light(editor.scene, editor.selection.index, aimed)
                editor.apply(f"Aim '{light.name}'", scene)
            except SceneError as failure:
                self._reporter.failure(str(failure))
        if imgui.menu_item_simple("Look here"):
            camera = editor.scene.camera
            shift = subtract(hit.position_ws, camera.target)
            editor.look(replace(camera, eye=add(camera.eye, shift), target=hit.position_ws))
        imgui.end_popup()

    def _hover(self, scene: Scene, hovered: bool) -> None:
        io = imgui.get_io()
        if not hovered:
            self._hovered_light = None
        elif io.mouse_delta.x or io.mouse_delta.y:
            hit = self._hit(io.mouse_pos.x, io.mouse_pos.y)
            is_light = hit is not None and hit.kind == "light" and hit.index < len(scene.lights)
            self._hovered_light = hit.index if hit is not None and is_light else None

    # --- corners -------------------------------------------------------------------

    def _handles(self, editor: Editor) -> None:
        light = editor.selected_light
        if light is None:
            self._corner = None
            return
        index, camera = editor.selection.index, self.camera_of(editor.scene)
        vertices = lights.vertices_of(light)
        if len(vertices) > MOST_HANDLES:
            return
        for vertex, point in vertices:
            at = self.view.project(camera, planes.point_on(light.plane, point))
            name = f"vertex {vertex[0]}.{vertex[1]}"
            if at is not None and self._handle(name, at):
                editor.selection = Selection.light(index, vertex)
                self._begin_corner(editor, f"Move corner of '{light.name}'", vertex, at)
            if at is not None:
                self._corner_menu(editor, index, vertex)
        for middle in middles_of(self.view, camera, light):
            vertex = (middle.contour, middle.edge + 1)
            grabbed = self._corner is not None and self._corner.vertex == vertex
            name = f"edge {middle.contour}.{middle.edge}"
            if (middle.has_room or grabbed) and self._handle(name, middle.at):
                wider = lights.add_vertex(light, middle.contour, middle.edge)
                self._begin_corner(editor, f"Add corner to '{light.name}'", vertex, middle.at)
                editor.update(edits.replace_light(editor.scene, index, wider))
                editor.selection = Selection.light(index, vertex)
                break
        self._drag_corner(editor)

    def _handle(self, name: str, at: tuple[float, float]) -> bool:
        """Submit an invisible button around a point and tell whether it was just pressed."""
        if not self.view.contains(*at) and self._corner is None:
            return False
        half = self._unit * HANDLE
        imgui.set_cursor_screen_pos(ImVec2(at[0] - half, at[1] - half))
        buttons = imgui.ButtonFlags_.mouse_button_left | imgui.ButtonFlags_.mouse_button_right
        imgui.invisible_button(name, ImVec2(2.0 * half, 2.0 * half), buttons)
        if imgui.is_item_hovered() or imgui.is_item_active():
            imgui.set_mouse_cursor(imgui.MouseCursor_.hand)
        return imgui.is_item_activated() and imgui.is_mouse_down(imgui.MouseButton_.left)

    def _begin_corner(
        self, editor: Editor, name: str, vertex: tuple[int, int], at: tuple[float, float]
    ) -> None:
        mouse = imgui.get_io().mouse_pos
        editor.begin(name)
        grip = (at[0] - mouse.x, at[1] - mouse.y)
        self._corner = CornerDrag(editor.selection.index, vertex, grip)

    def _drag_corner(self, editor: Editor) -> None:
        """Let the grabbed corner follow the pointer on the light's plane."""
        drag = self._corner
        if drag is None:
            return
        if not editor.is_dragging or not imgui.is_mouse_down(imgui.MouseButton_.left):
            self._corner = None
            return
        io = imgui.get_io()
        light = editor.scene.lights[drag.light]
        if not (io.mouse_delta.x or io.mouse_delta.y):
            return
        camera, plane = self.camera_of(editor.scene), light.plane
        direction = self.view.ray(
            camera, io.mouse_pos.x + drag.grip[0], io.mouse_pos.y + drag.grip[1]
        )
        hit = control.intersect_plane(camera.eye, direction, plane.origin, planes.normal_of(plane))
        if hit is not None:
            moved = lights.move_vertex(light, drag.vertex, planes.coordinates_on(plane, hit))
            editor.update(edits.replace_light(editor.scene, drag.light, moved))

    def _edge_at(self, editor: Editor, x: float, y: float) -> tuple[int, int, float] | None:
        """Return (contour, edge, how far along) of the selected light's outline at the pointer."""
        light = editor.selected_light
        if light is None:
            return None
        camera, plane = self.camera_of(editor.scene), light.plane
        direction = self.view.ray(camera, x, y)
        hit = control.intersect_plane(camera.eye, direction, plane.origin, planes.normal_of(plane))
        if hit is None:
            return None
        contour, edge, along = lights.nearest_edge(light, planes.coordinates_on(plane, hit))
        point = lights.point_along(light, contour, edge, along)
        at = self.view.project(camera, planes.point_on(plane, point))
        if at is None or math.dist(at, (x, y)) > self._unit * HANDLE:
            return None
        return contour, edge, along

    def _split_edge(self, editor: Editor, x: float, y: float) -> None:
        """Add a corner where the selected light's outline was double-clicked."""
        found, light = self._edge_at(editor, x, y), editor.selected_light
        if found is None or light is None:
            return
        contour, edge, along = found
        index = editor.selection.index
        wider = lights.add_vertex(light, contour, edge, along)
        editor.apply(
            f"Add corner to '{light.name}'", edits.replace_light(editor.scene, index, wider)
        )
        editor.selection = Selection.light(index, (contour, edge + 1))

    def _corner_menu(self, editor: Editor, index: int, vertex: tuple[int, int]) -> None:
        if imgui.begin_popup_context_item(f"corner {vertex[0]}.{vertex[1]}"):
            light = editor.scene.lights[index]
            chosen = None
            if imgui.menu_item_simple("Remove corner", key_of("remove")):
                chosen = lights.remove_vertex
            if len(light.outline.contours) > 1 and imgui.menu_item_simple("Remove outline"):
                chosen = _remove_outline
            if chosen is not None:
                try:
                    scene = edits.replace_light(editor.scene, index, chosen(light, vertex))
                    editor.apply(f"Remove corner of '{light.name}'", scene)
                except SceneError as failure:
                    self._reporter.failure(str(failure))
            imgui.end_popup()

    # --- gizmo ---------------------------------------------------------------------

    def _manipulate(self, editor: Editor) -> None:
        """Move or turn what is selected with ImGuizmo."""
        selection, scene = editor.selection, editor.scene
        if selection.kind == "none" or self._corner is not None:
            self._gizmo, self._gizmo_hovered = None, False
            return
        view, camera = self.view, self.camera_of(scene)
        gizmo.set_drawlist()
        gizmo.set_rect(view.x, view.y, view.width, view.height)
        start = pose_of(scene, selection) if self._gizmo is None else None
        matrix = gizmo.Matrix16(_columns(pose_of(scene, selection)))
        changed = gizmo.manipulate(
            gizmo.Matrix16(_columns(control.view_from_world(camera))),
            gizmo.Matrix16(_columns(control.clip_from_view(camera, view.width / view.height))),
            gizmo.OPERATION.translate if self.tool == "move" else gizmo.OPERATION.rotate,
            gizmo.MODE.local,
            matrix,
        )
        self._gizmo_hovered = gizmo.is_over()
        if not gizmo.is_using():
            self._gizmo = None
            return
        if self._gizmo is None and start is not None:
            name = name_of(scene, selection)
            editor.begin(f"{'Move' if self.tool == 'move' else 'Rotate'} '{name}'")
            self._gizmo = GizmoDrag(scene, selection, start)
        drag = self._gizmo
        if changed and drag is not None and editor.is_dragging:
            pose = np.array(matrix.values, dtype=np.float64).reshape(4, 4).T
            motion = pose @ np.linalg.inv(drag.matrix)
            moved = moved_by(drag.scene, drag.selection, motion)
            editor.update(replace(moved, camera=scene.camera))

    # --- over the picture -------------------------------------------------------------

    def _overlays(self, editor: Editor) -> None:
        scene, chosen = editor.scene, editor.selection
        camera = self.camera_of(scene)
        view, draw = self.view, imgui.get_window_draw_list()
        canvas = Canvas(draw, view, camera, self._unit)
        high = ImVec2(view.x + view.width, view.y + view.height)
        draw.push_clip_rect(ImVec2(view.x, view.y), high, True)
        for index, light in enumerate(scene.lights):
            if chosen.kind == "light" and chosen.index == index:
                canvas.outline(light, theme.ACCENT, 1.0, 1.8)
                canvas.direction(light)
                self._corners(editor, light, camera)
            elif index == self._hovered_light:
                canvas.outline(light, theme.ACCENT, 0.55, 1.5)
            elif not light.visible:
                canvas.outline(light, theme.grey(0.9), 0.3, 1.0)
        if chosen.kind == "object":
            with contextlib.suppress(InputError):
                canvas.box(box_corners(scene, chosen.index))
        draw.pop_clip_rect()

    def _corners(self, editor: Editor, light: AreaLight, camera: Camera) -> None:
        """Draw the handles of the selected light."""
        vertices = lights.vertices_of(light)
        draw, crowded = imgui.get_window_draw_list(), len(vertices) > CROWD
        canvas = Canvas(draw, self.view, camera, self._unit, crowded)
        if len(vertices) > MOST_HANDLES:
            return
        if self.is_settled:
            self._find_hidden(editor.scene, editor.selection.index)
        mouse = imgui.get_io().mouse_pos
        for middle in middles_of(self.view, camera, light):
            if middle.has_room:
                canvas.middle(middle.at, near=is_near(middle.at, mouse, self._unit))
        for vertex, point in vertices:
            at = self.view.project(camera, planes.point_on(light.plane, point))
            if at is not None:
                canvas.corner(
                    at,
                    near=is_near(at, mouse, self._unit),
                    chosen=editor.selection.vertex == vertex,
                    hidden=vertex in self._hidden,
                )

    def _find_hidden(self, scene: Scene, index: int) -> None:
        """Find out, a few at a time once nothing moves, which corners are behind something."""
        light, camera = scene.lights[index], self.camera_of(scene)
        if self._occlusion_of != (self.picture.shot, index):
            self._occlusion_of = (self.picture.shot, index)
            self._unasked = lights.vertices_of(light)[:MOST_ASKED]
        end = time.perf_counter() + ASKING
        while self._unasked and time.perf_counter() < end:
            vertex, point = self._unasked.pop()
            corner = planes.point_on(light.plane, point)
            at = self.view.project(camera, corner)
            hit = self._hit(*at) if at is not None else None
            away = length(subtract(corner, camera.eye))
            behind = (
                hit is not None
                and (hit.kind, hit.index) != ("light", index)
                and length(subtract(hit.position_ws, camera.eye)) < 0.999 * away
            )
            self._hidden = self._hidden | {vertex} if behind else self._hidden - {vertex}
        self._is_asking = bool(self._unasked)


def _remove_outline(light: AreaLight, vertex: tuple[int, int]) -> AreaLight:
    return lights.remove_contour(light, vertex[0])


def _columns(matrix: np.ndarray) -> list[float]:
    """Return the 16 numbers of a matrix column by column, as ImGuizmo takes them."""
    return [float(value) for value in matrix.T.reshape(-1)]
