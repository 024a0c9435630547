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
from app.gui.comparison import Comparison
from app.gui.legend import draw_legend
from app.gui.live_picture import LivePicture
from app.gui.messages import Messages
from app.gui.outline_tool import OutlineTool, Spot
from app.gui.overlays import Canvas, Sight, View, help_line
from app.gui.placement import box_corners, moved_by, name_of, pose_of, sphere_around
from app.gui.playback import Playback
from app.render import cost
from app.render.picking import Hit
from app.render.renderer import Renderer
from app.scene import Camera, RenderSettings, Scene, SceneError, Shot, Vec2, Vec3
from app.vectors import add, length, subtract

STILL_SAMPLES = 32
"""How many samples per pixel a still picture gathers unless told otherwise."""
UNDER_STATUS_BAR = 1
"""Points by which hello_imgui's status bar covers the docked windows."""

MOST_ASKED = 64
"""How many corners of a light are asked whether they are behind something."""
ASKING = 0.004
"""Seconds per frame for asking."""


@dataclass(frozen=True, slots=True)
class GizmoDrag:
    """A gizmo in use: the scene and the matrix it began with."""

    scene: Scene
    selection: Selection
    matrix: np.ndarray


class Viewport:
    """Draws the picture and turns what is done to it into edits.

    ``hovered`` is what was under the pointer last, ``pointer`` where that was, 0 to 1 from the
    picture's upper left; ``pin`` a point to mark, with its normal and tangent, ``asked_pin`` one
    that Ctrl+click asks for.

    Parameters
    ----------
    renderer : Renderer
        Picks, and renders what `LivePicture` asks for.
    messages : Messages
        Gets the failures of rendering and editing.
    """

    def __init__(self, renderer: Renderer, messages: Messages) -> None:
        self.settings = RenderSettings(samples=STILL_SAMPLES)
        self.tool = "move"
        self.show_overlays = True
        self.help = ""
        self.view = View(0.0, 0.0, 1.0, 1.0, (1, 1))
        self.picture = LivePicture(renderer, messages)
        self.comparison = Comparison(renderer, messages)
        self.playback = Playback(messages)
        self.outline = OutlineTool(messages)
        self._renderer = renderer
        self._messages = messages
        self._gizmo: GizmoDrag | None = None
        self._gizmo_hovered = False
        self._unit = 1.0
        self._moved = 0.0
        self._hidden: frozenset[tuple[int, int]] = frozenset()
        self._unasked: list[tuple[tuple[int, int], Vec2]] = []
        self._is_asking = False
        self._occlusion_of: tuple[Shot | None, int, tuple[lights.Vertex, ...]] | None = None
        self.hovered: Hit | None = None
        self.pointer: tuple[float, float] | None = None
        self.pin: tuple[Vec3, Vec3, Vec3] | None = None
        self.asked_pin: Hit | None = None
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
        return self.is_settled and not self._is_asking and self.comparison.is_idle

    @property
    def needs_frames(self) -> bool:
        """Whether frames shall follow each other as fast as they can."""
        return not self.is_settled or self._is_asking or self.comparison.needs_frames

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
            self.outline.submit(editor, self._sight(editor.scene))
        else:
            self.outline.let_go()
        self.comparison.divide(self.view)
        self._canvas(editor)
        self._picture(self._played(editor.scene))
        if self.comparison.shows_cost(self.settings):
            draw_legend(self.view, cost.LEGEND)
        self._is_asking = False
        if self.show_overlays:
            self._overlays(editor)
            self._manipulate(editor)
            help_line(self.view, self.help)

    def _played(self, scene: Scene) -> Scene:
        """Let pictures on lights play and change, and return the scene as it can be shown."""
        changes = self.playback.changes
        scene = self.playback.step(scene, time.monotonic())
        if self.playback.time != self.settings.time:
            self.settings = replace(self.settings, time=self.playback.time)
        if self.playback.changes != changes:
            self.picture.begin_again()
            self.comparison.begin_again()
        return scene

    def _picture(self, scene: Scene) -> None:
        """Render what is missing of the picture, or of both that are compared, and draw it."""
        view, camera, comparison = self.view, self.camera_of(scene), self.comparison
        settings = comparison.settings(scene, self.settings)
        self.picture.render(scene, camera, settings[0], view.pixels)
        comparison.render(scene, camera, settings, view.pixels, self.picture)
        if comparison.is_on:
            comparison.draw(view, self.picture)
        else:
            self.picture.draw(view)

    def camera_of(self, scene: Scene) -> Camera:
        """Return the camera that the picture is seen with."""
        return control.widened(scene.camera, self.view.width / self.view.height)

    def _sight(self, scene: Scene) -> Sight:
        return Sight(self.view, self.camera_of(scene), self._unit)

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
                if io.key_ctrl:
                    self.asked_pin = self._hit(io.mouse_pos.x, io.mouse_pos.y)
                else:
                    self._select(editor, io.mouse_pos.x, io.mouse_pos.y)
            elif imgui.is_mouse_released(imgui.MouseButton_.right):
                self._ask(editor, io.mouse_pos.x, io.mouse_pos.y)
        self._place_menu(editor)
        self.outline.segment_menu(editor)
        if hovered and imgui.is_mouse_double_clicked(imgui.MouseButton_.left):
            spot = self._spot(editor, io.mouse_pos.x, io.mouse_pos.y)
            if spot is not None:
                self.outline.insert(editor, spot)
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

    def _spot(self, editor: Editor, x: float, y: float) -> Spot | None:
        """Return the place of the selected light's outline at the pointer, if it is shown."""
        if not self.show_overlays:
            return None
        return self.outline.spot_at(editor, self._sight(editor.scene), x, y)

    def _ask(self, editor: Editor, x: float, y: float) -> None:
        """Open the menu of the outline, or else of the place, under a click."""
        spot = self._spot(editor, x, y)
        if spot is not None:
            self.outline.ask_about(spot)
            return
        self._asked = self._hit(x, y)
        if self._asked is not None:
            imgui.open_popup("place")

    def _select(self, editor: Editor, x: float, y: float) -> None:
        if self._spot(editor, x, y) is not None:
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
                self._messages.failure(str(failure))
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
            self.hovered, view = hit, self.view
            x, y = io.mouse_pos.x - view.x, io.mouse_pos.y - view.y
            self.pointer = x / view.width, y / view.height

    # --- gizmo ---------------------------------------------------------------------

    def _manipulate(self, editor: Editor) -> None:
        """Move or turn what is selected with ImGuizmo."""
        selection, scene = editor.selection, editor.scene
        if selection.kind == "none" or self.outline.is_dragging:
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
        view, draw, sight = self.view, imgui.get_window_draw_list(), self._sight(scene)
        canvas = Canvas(draw, sight)
        high = ImVec2(view.x + view.width, view.y + view.height)
        draw.push_clip_rect(ImVec2(view.x, view.y), high, True)
        for index, light in enumerate(scene.lights):
            if chosen.kind == "light" and chosen.index == index:
                canvas.outline(light, theme.ACCENT, 1.0, 1.8)
                canvas.direction(light)
                self.outline.draw(editor, sight, self._hidden)
                if self.is_settled:
                    self._find_hidden(scene, index)
            elif index == self._hovered_light:
                canvas.outline(light, theme.ACCENT, 0.55, 1.5)
            elif not light.visible:
                canvas.outline(light, theme.grey(0.9), 0.3, 1.0)
        if chosen.kind == "object":
            with contextlib.suppress(InputError):
                canvas.box(box_corners(scene, chosen.index))
        if self.pin is not None:
            canvas.pin(*self.pin)
        draw.pop_clip_rect()

    def _find_hidden(self, scene: Scene, index: int) -> None:
        """Find out, a few at a time once nothing moves, which corners are behind something."""
        light, camera = scene.lights[index], self.camera_of(scene)
        shown = self.outline.shown
        if self._occlusion_of != (self.picture.shot, index, shown):
            self._occlusion_of = (self.picture.shot, index, shown)
            places = dict(lights.vertices_of(light))
            asked = [(vertex, places[vertex]) for vertex in shown if vertex in places]
            self._unasked = asked[:MOST_ASKED]
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


def _columns(matrix: np.ndarray) -> list[float]:
    """Return the 16 numbers of a matrix column by column, as ImGuizmo takes them."""
    return [float(value) for value in matrix.T.reshape(-1)]
