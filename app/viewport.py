"""The picture in the window, and everything in it that can be grabbed.

One frame goes: pointer and keys change the scene through the editor, the
renderer adds a sample of that scene, the picture and the outlines and handles
over it are drawn. So what lies over the picture always belongs to it.

While something moves, each frame shows one fresh sample, smaller where a
full-size one takes longer than `SLOW`. When nothing moves, samples gather up to
the wanted number, and then no pass runs at all.
"""

from __future__ import annotations

import math
import time
import traceback
from collections import deque
from dataclasses import dataclass, replace
from typing import Protocol

import moderngl
import numpy as np
from imgui_bundle import ImVec2, ImVec4, imgui
from imgui_bundle.imguizmo import im_guizmo as gizmo

from app import camera_control as control
from app import edits, theme
from app.editor import NOTHING, Editor, Selection
from app.errors import InputError
from app.meshes import load_mesh
from app.render.camera import world_from_object
from app.render.renderer import Hit, Renderer
from app.scene import AreaLight, Camera, RenderSettings, Scene, SceneError, Shot, Vec2, Vec3
from app.vectors import add, length, mix, scale, subtract

SLOW = 0.045
"""Seconds for a full-size sample from which on moving pictures are smaller."""
SETTLE = 0.2
"""Seconds without movement after which a smaller picture becomes full-size; more, up to
`LONGEST_SETTLE`, where a full-size sample takes longer than that."""
LONGEST_SETTLE = 1.0

SMALLEST = 4
"""Most that width and height of a moving picture are divided by."""
LEAST_ASPECT = 16.0 / 9.0
WIDEST = math.radians(150.0)
UNDER_STATUS_BAR = 1
"""Points by which hello_imgui's status bar covers the docked windows."""

HANDLE = 9.0
"""Half the side of the square in which a corner can be grabbed, in points."""
SHORTEST_EDGE = 56.0
"""Length in points from which on an edge offers a point to add a corner."""
MOST_HANDLES = 400
"""Corners beyond this number get no handles: they would hide the light."""
MOST_ASKED = 64
"""How many corners of a light are asked whether they are behind something."""
ASKING = 0.004
"""Seconds per frame for asking."""


class Reporter(Protocol):
    """Where sentences for the user go."""

    def failure(self, text: str) -> None: ...


def widened(camera: Camera, aspect: float) -> Camera:
    """Return the camera with a field of view that shows the width of a `LEAST_ASPECT` picture.

    Scenes are composed for wide pictures; a narrow window shows more above and
    below instead of cutting off the sides.
    """
    if aspect >= LEAST_ASPECT:
        return camera
    half = math.atan(math.tan(camera.fov_y / 2.0) * LEAST_ASPECT / aspect)
    return replace(camera, fov_y=min(2.0 * half, WIDEST))


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


@dataclass(frozen=True, slots=True)
class View:
    """The picture's place on the screen: corner and size in points, size in pixels."""

    x: float
    y: float
    width: float
    height: float
    pixels: tuple[int, int]

    def project(self, camera: Camera, point: Vec3) -> tuple[float, float] | None:
        """Return screen coordinates of a world point, None behind the eye."""
        found = control.project(camera, point, self.width, self.height)
        return None if found is None else (self.x + found[0], self.y + found[1])

    def ray(self, camera: Camera, x: float, y: float) -> Vec3:
        """Return the direction of the ray through screen coordinates."""
        return control.ray_through(camera, x - self.x, y - self.y, self.width, self.height)

    def contains(self, x: float, y: float) -> bool:
        return self.x <= x < self.x + self.width and self.y <= y < self.y + self.height


class Viewport:
    """Draws the picture and turns what is done to it into edits.

    Parameters
    ----------
    renderer : Renderer
        Renders and picks; this class alone decides when.
    reporter : Reporter
        Gets the failures of rendering and editing.
    """

    def __init__(self, renderer: Renderer, reporter: Reporter) -> None:
        self.tool = "move"
        self.show_overlays = True
        self.help = ""
        self.samples = (0, 0)
        self.history: deque[float] = deque(maxlen=120)
        self.view = View(0.0, 0.0, 1.0, 1.0, (1, 1))
        self._renderer = renderer
        self._reporter = reporter
        self._corner: CornerDrag | None = None
        self._gizmo: GizmoDrag | None = None
        self._gizmo_hovered = False
        self._unit = 1.0
        self._moved = 0.0
        self._shot: Shot | None = None
        self._wanted: Scene | None = None
        self._shown: tuple[Scene, Camera, Scene] | None = None
        self._failed: Shot | None = None
        self._full_size_seconds = 0.0
        self._divisor = 1
        self._hidden: frozenset[tuple[int, int]] = frozenset()
        self._unasked: list[tuple[tuple[int, int], Vec2]] = []
        self._is_asking = False
        self._occlusion_of: tuple[Shot | None, int] | None = None
        self._hovered_light: int | None = None
        self._asked: Hit | None = None
        self._changed_at = 0.0

    # --- the outside ----------------------------------------------------------

    @property
    def is_busy(self) -> bool:
        """Whether a gizmo is in use, which Dear ImGui does not count as an active item."""
        return self._gizmo is not None

    @property
    def is_settled(self) -> bool:
        """Whether the picture has all its samples at full size and shows the present scene."""
        if self._failed is not None:
            return True
        shot = self._shot
        return (
            shot is not None
            and self.samples[0] >= self.samples[1]
            and (shot.width, shot.height) == self.view.pixels
        )

    @property
    def is_idle(self) -> bool:
        """Whether nothing is left to do until the user does something."""
        return self.is_settled and not self._is_asking

    @property
    def shot(self) -> Shot | None:
        """What the picture shows."""
        return self._shot

    def frame(self, editor: Editor) -> None:
        """Turn the camera's attention to what is selected, or to the whole scene."""
        spheres = list(_spheres(editor.scene, editor.selection))
        if not spheres:
            return
        low = np.min([np.array(centre) - radius for centre, radius in spheres], axis=0)
        high = np.max([np.array(centre) + radius for centre, radius in spheres], axis=0)
        x, y, z = ((low + high) / 2.0).tolist()
        radius = spheres[0][1] if len(spheres) == 1 else float(np.linalg.norm(high - low)) / 2.0
        aspect = max(self.view.width / self.view.height, LEAST_ASPECT)
        editor.look(control.frame(editor.scene.camera, (x, y, z), radius, aspect))

    def draw(self, editor: Editor, settings: RenderSettings) -> None:
        """Draw one frame into the current Dear ImGui window."""
        self._place()
        if self.show_overlays and self._gizmo is None:
            self._handles(editor)
        self._canvas(editor)
        self._render(editor.scene, settings)
        self._picture()
        self._is_asking = False
        if self.show_overlays:
            self._overlays(editor)
            self._manipulate(editor)
            self._help_line()

    def camera_of(self, scene: Scene) -> Camera:
        """Return the camera that the picture is seen with."""
        return widened(scene.camera, self.view.width / self.view.height)

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
        view, shot = self.view, self._shot
        if shot is None or self._failed is not None or not view.contains(x, y):
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
                aimed = edits.aim(light, hit.position_ws)
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
        vertices = edits.vertices_of(light)
        if len(vertices) > MOST_HANDLES:
            return
        for vertex, point in vertices:
            at = self.view.project(camera, edits.point_on(light.plane, point))
            name = f"vertex {vertex[0]}.{vertex[1]}"
            if at is not None and self._handle(name, at):
                editor.selection = Selection.light(index, vertex)
                self._begin_corner(editor, f"Move corner of '{light.name}'", vertex, at)
            if at is not None:
                self._corner_menu(editor, index, vertex)
        for contour, edge, at, long_enough in _edge_middles(self.view, camera, light):
            name = f"edge {contour}.{edge}"
            grabbed = self._corner is not None and self._corner.vertex == (contour, edge + 1)
            if (long_enough or grabbed) and self._handle(name, at):
                vertex = (contour, edge + 1)
                wider = edits.add_vertex(light, contour, edge)
                scene = edits.replace_light(editor.scene, index, wider)
                self._begin_corner(editor, f"Add corner to '{light.name}'", vertex, at)
                editor.update(scene)
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
        hit = control.intersect_plane(camera.eye, direction, plane.origin, edits.normal_of(plane))
        if hit is not None:
            moved = edits.move_vertex(light, drag.vertex, edits.coordinates_on(plane, hit))
            editor.update(edits.replace_light(editor.scene, drag.light, moved))

    def _edge_at(self, editor: Editor, x: float, y: float) -> tuple[int, int, float] | None:
        """Return (contour, edge, how far along) of the selected light's outline at the pointer."""
        light = editor.selected_light
        if light is None:
            return None
        camera, plane = self.camera_of(editor.scene), light.plane
        direction = self.view.ray(camera, x, y)
        hit = control.intersect_plane(camera.eye, direction, plane.origin, edits.normal_of(plane))
        if hit is None:
            return None
        contour, edge, along = edits.nearest_edge(light, edits.coordinates_on(plane, hit))
        points = light.outline.contours[contour].points
        point = mix(points[edge], points[(edge + 1) % len(points)], along)
        at = self.view.project(camera, edits.point_on(plane, point))
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
        wider = edits.add_vertex(light, contour, edge, along)
        editor.apply(
            f"Add corner to '{light.name}'", edits.replace_light(editor.scene, index, wider)
        )
        editor.selection = Selection.light(index, (contour, edge + 1))

    def _corner_menu(self, editor: Editor, index: int, vertex: tuple[int, int]) -> None:
        if imgui.begin_popup_context_item(f"corner {vertex[0]}.{vertex[1]}"):
            light = editor.scene.lights[index]
            chosen = None
            if imgui.menu_item_simple("Remove corner", "Del"):
                chosen = edits.remove_vertex
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
        start = _pose(scene, selection) if self._gizmo is None else None
        matrix = gizmo.Matrix16(_columns(_pose(scene, selection)))
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
            name = _name_of(scene, selection)
            editor.begin(f"{'Move' if self.tool == 'move' else 'Rotate'} '{name}'")
            self._gizmo = GizmoDrag(scene, selection, start)
        drag = self._gizmo
        if changed and drag is not None and editor.is_dragging:
            pose = np.array(matrix.values, dtype=np.float64).reshape(4, 4).T
            rigid = _rigid(pose @ np.linalg.inv(drag.matrix))
            moved = _moved_by(drag.scene, drag.selection, rigid)
            editor.update(replace(moved, camera=scene.camera))

    # --- rendering -----------------------------------------------------------------

    def _render(self, scene: Scene, settings: RenderSettings) -> None:
        """Add a sample unless the picture has all of them; never let a failure out."""
        now = time.monotonic()
        if self._wanted is None or _other_radiance(self._wanted, scene):
            self._changed_at = now
        self._wanted = scene
        patience = min(max(SETTLE, self._full_size_seconds), LONGEST_SETTLE)
        moving = now - self._changed_at < patience
        width, height = self.view.pixels
        divisor = 1
        if moving and self._full_size_seconds > SLOW:
            divisor = min(math.ceil(math.sqrt(self._full_size_seconds / SLOW)), SMALLEST)
        width, height = math.ceil(width / divisor), math.ceil(height / divisor)
        camera = self.camera_of(scene)
        if self._shown is None or self._shown[0] is not scene or self._shown[1] != camera:
            self._shown = (scene, camera, replace(scene, camera=camera))
        shot = Shot(self._shown[2], replace(settings, samples=1), width, height)
        if shot == self._failed:
            return
        if shot == self._shot and self.samples[0] >= settings.samples:
            return
        try:
            began = time.perf_counter()
            samples = self._renderer.accumulate(shot, settings.samples)
            seconds = time.perf_counter() - began
        except Exception as failure:
            if not isinstance(failure, InputError):
                traceback.print_exc()
            self._failed, self.samples = shot, (0, settings.samples)
            self._reporter.failure(str(failure) or type(failure).__name__)
            return
        finally:
            self._renderer.ctx.screen.use()
        self._failed, self._shot, self.samples = None, shot, (samples, settings.samples)
        timings = self._renderer.timings(wait=False)
        gpu = sum(value for name, value in timings.items() if name != "cpu") / 1e3
        self.history.append(1e3 * max(seconds, gpu))
        # The GPU's figures are those of the sample before, the size of which counts.
        self._full_size_seconds = seconds + gpu * self._divisor**2
        self._divisor = divisor

    def _picture(self) -> None:
        view, draw = self.view, imgui.get_window_draw_list()
        low, high = ImVec2(view.x, view.y), ImVec2(view.x + view.width, view.y + view.height)
        if self._shot is None or self._failed is not None:
            draw.add_rect_filled(low, high, theme.u32(theme.grey(0.07)))
            return
        texture = self._renderer.texture
        self._renderer.ctx.screen.use()
        same_size = texture.size == view.pixels
        kind = moderngl.NEAREST if same_size else moderngl.LINEAR
        if texture.filter != (kind, kind):
            texture.filter = (kind, kind)
        reference = imgui.ImTextureRef(texture.glo)
        draw.add_image(reference, low, high, ImVec2(0.0, 1.0), ImVec2(1.0, 0.0))

    # --- over the picture -------------------------------------------------------------

    def _overlays(self, editor: Editor) -> None:
        scene, chosen = editor.scene, editor.selection
        camera = self.camera_of(scene)
        draw, view = imgui.get_window_draw_list(), self.view
        high = ImVec2(view.x + view.width, view.y + view.height)
        draw.push_clip_rect(ImVec2(view.x, view.y), high, True)
        for index, light in enumerate(scene.lights):
            selected = chosen.kind == "light" and chosen.index == index
            if selected:
                self._outline(draw, camera, light, theme.ACCENT, 1.0, 1.8)
            elif index == self._hovered_light:
                self._outline(draw, camera, light, theme.ACCENT, 0.55, 1.5)
            elif not light.visible:
                self._outline(draw, camera, light, theme.grey(0.9), 0.3, 1.0)
        if chosen.kind == "object":
            self._box(draw, camera, scene, chosen.index)
        active = editor.selected_light
        if active is not None:
            self._direction(draw, camera, active)
            if len(edits.vertices_of(active)) <= MOST_HANDLES:
                self._corners(draw, editor, active)
        draw.pop_clip_rect()

    def _outline(
        self,
        draw: imgui.ImDrawList,
        camera: Camera,
        light: AreaLight,
        colour: ImVec4,
        alpha: float,
        thickness: float,
    ) -> None:
        ink, shade = theme.u32(colour, alpha), theme.u32(theme.grey(0.0), 0.35 * alpha)
        for contour in light.outline.contours:
            points = [edits.point_on(light.plane, point) for point in contour.points]
            for a, b in zip(points, points[1:] + points[:1], strict=True):
                ends = self._segment(camera, a, b)
                if ends is not None:
                    draw.add_line(*ends, shade, thickness + 2.0)
                    draw.add_line(*ends, ink, thickness)

    def _box(self, draw: imgui.ImDrawList, camera: Camera, scene: Scene, index: int) -> None:
        """Draw the edges of an object's bounding box."""
        try:
            corners = _box_corners(scene, index)
        except InputError:
            return
        for a in range(8):
            for axis in (1, 2, 4):
                if not a & axis:
                    ends = self._segment(camera, corners[a], corners[a | axis])
                    if ends is not None:
                        draw.add_line(*ends, theme.u32(theme.ACCENT, 0.45), 1.0)

    def _segment(self, camera: Camera, a: Vec3, b: Vec3) -> tuple[ImVec2, ImVec2] | None:
        clipped = control.clip_to_view(camera, a, b)
        if clipped is None:
            return None
        first, last = (self.view.project(camera, point) for point in clipped)
        if first is None or last is None:
            return None
        return ImVec2(*first), ImVec2(*last)

    def _direction(self, draw: imgui.ImDrawList, camera: Camera, light: AreaLight) -> None:
        """Draw a short line from the light's centre to where it shines."""
        centre, radius = edits.bounds_of(light)
        tip = add(centre, scale(edits.normal_of(light.plane), 0.6 * radius))
        ends = self._segment(camera, centre, tip)
        if ends is not None:
            draw.add_line(*ends, theme.u32(theme.ACCENT, 0.5), 1.5)
            draw.add_circle_filled(ends[1], 3.0, theme.u32(theme.ACCENT, 0.8))

    def _corners(self, draw: imgui.ImDrawList, editor: Editor, light: AreaLight) -> None:
        camera, mouse = self.camera_of(editor.scene), imgui.get_io().mouse_pos
        if self.is_settled:
            self._find_hidden(editor.scene, editor.selection.index)
        for _, _, at, long_enough in _edge_middles(self.view, camera, light):
            if long_enough:
                self._middle(draw, at, _is_near(at, mouse, self._unit))
        for vertex, point in edits.vertices_of(light):
            at_corner = self.view.project(camera, edits.point_on(light.plane, point))
            if at_corner is not None:
                near = _is_near(at_corner, mouse, self._unit)
                chosen = editor.selection.vertex == vertex
                dim = vertex in self._hidden and not (near or chosen)
                self._dot(draw, at_corner, near, chosen, 0.4 if dim else 1.0)

    def _middle(self, draw: imgui.ImDrawList, at: tuple[float, float], near: bool) -> None:
        """Draw the dot that adds a corner, a plus under the pointer."""
        radius, alpha = (5.0, 1.0) if near else (2.5, 0.6)
        radius *= self._unit
        centre, arm = ImVec2(*at), 3.0 * self._unit
        draw.add_circle_filled(centre, radius + 1.0, theme.u32(theme.grey(0.0), 0.5))
        draw.add_circle_filled(centre, radius, theme.u32(theme.grey(0.95), alpha))
        if near:
            ink = theme.u32(theme.grey(0.1))
            draw.add_line(ImVec2(at[0] - arm, at[1]), ImVec2(at[0] + arm, at[1]), ink, 1.5)
            draw.add_line(ImVec2(at[0], at[1] - arm), ImVec2(at[0], at[1] + arm), ink, 1.5)

    def _dot(
        self,
        draw: imgui.ImDrawList,
        at: tuple[float, float],
        near: bool,
        chosen: bool,
        alpha: float,
    ) -> None:
        """Draw a corner: larger under the pointer, ringed when selected."""
        centre = ImVec2(*at)
        radius = self._unit * (6.5 if near or chosen else 5.0)
        fill = theme.ACCENT if chosen or near else theme.grey(0.97)
        draw.add_circle_filled(centre, radius + 1.5, theme.u32(theme.grey(0.0), 0.6 * alpha))
        draw.add_circle_filled(centre, radius, theme.u32(fill, alpha))
        if chosen:
            draw.add_circle(centre, radius + 3.0, theme.u32(theme.ACCENT), 0, 1.5)

    def _find_hidden(self, scene: Scene, index: int) -> None:
        """Find out, a few at a time once nothing moves, which corners are behind something."""
        light, camera = scene.lights[index], self.camera_of(scene)
        if self._occlusion_of != (self._shot, index):
            self._occlusion_of = (self._shot, index)
            self._unasked = edits.vertices_of(light)[:MOST_ASKED]
        end = time.perf_counter() + ASKING
        while self._unasked and time.perf_counter() < end:
            vertex, point = self._unasked.pop()
            corner = edits.point_on(light.plane, point)
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

    def _help_line(self) -> None:
        """Write the help over the lower edge of the picture."""
        if not self.help:
            return
        view, draw = self.view, imgui.get_window_draw_list()
        size, pad = imgui.calc_text_size(self.help), 0.7 * imgui.get_font_size()
        if size.x + 4.0 * pad > view.width:
            return
        x = view.x + 0.5 * (view.width - size.x)
        y = view.y + view.height - size.y - 2.0 * pad
        low, high = ImVec2(x - pad, y - 0.5 * pad), ImVec2(x + size.x + pad, y + size.y + 0.5 * pad)
        draw.add_rect_filled(low, high, theme.u32(theme.grey(0.06), 0.72), 6.0)
        draw.add_text(ImVec2(x, y), theme.u32(theme.grey(0.86)), self.help)


def _other_radiance(a: Scene, b: Scene) -> bool:
    """Tell whether two scenes may differ in more than exposure and tone map."""
    return not (
        a.camera is b.camera
        and a.lights is b.lights
        and a.objects is b.objects
        and a.materials is b.materials
    )


def _remove_outline(light: AreaLight, vertex: tuple[int, int]) -> AreaLight:
    return edits.remove_contour(light, vertex[0])


def _edge_middles(
    view: View, camera: Camera, light: AreaLight
) -> list[tuple[int, int, tuple[float, float], bool]]:
    """Return (contour, edge, middle on the screen, whether there is room for a handle)."""
    found = []
    for c, contour in enumerate(light.outline.contours):
        world = [edits.point_on(light.plane, point) for point in contour.points]
        for e, (a, b) in enumerate(zip(world, world[1:] + world[:1], strict=True)):
            first, last = view.project(camera, a), view.project(camera, b)
            middle = view.project(camera, scale(add(a, b), 0.5))
            if first is not None and last is not None and middle is not None:
                span = np.hypot(last[0] - first[0], last[1] - first[1])
                found.append((c, e, middle, bool(span >= SHORTEST_EDGE)))
    return found


def _is_near(at: tuple[float, float], mouse: ImVec2, unit: float) -> bool:
    """Tell whether the pointer is where a handle can be grabbed."""
    return max(abs(at[0] - mouse.x), abs(at[1] - mouse.y)) <= unit * HANDLE


def _columns(matrix: np.ndarray) -> list[float]:
    """Return the 16 numbers of a matrix column by column, as ImGuizmo takes them."""
    return [float(value) for value in matrix.T.reshape(-1)]


def _pose(scene: Scene, selection: Selection) -> np.ndarray:
    """Return the (4, 4) rotation and translation of what is selected; a light's z is its normal."""
    pose = np.eye(4)
    if selection.kind == "light":
        light = scene.lights[selection.index]
        normal = np.array(edits.normal_of(light.plane))
        u = np.array(light.plane.u) / length(light.plane.u)
        pose[:3, :3] = np.stack([u, np.cross(normal, u), normal], axis=1)
        pose[:3, 3] = edits.centre_of(light)
        return pose
    transform = scene.objects[selection.index].transform
    pose[:] = world_from_object(replace(transform, scale=(1.0, 1.0, 1.0)))
    return pose


def _rigid(matrix: np.ndarray) -> np.ndarray:
    """Return the nearest rotation and translation to a nearly rigid (4, 4) matrix."""
    left, _, right = np.linalg.svd(matrix[:3, :3])
    rigid = matrix.copy()
    rigid[:3, :3] = left @ right
    return rigid


def _moved_by(scene: Scene, selection: Selection, rigid: np.ndarray) -> Scene:
    if selection.kind == "light":
        light = scene.lights[selection.index]
        plane = edits.transform_plane(light.plane, rigid)
        return edits.replace_light(scene, selection.index, replace(light, plane=plane))
    item = edits.transform_object(scene.objects[selection.index], rigid)
    return edits.replace_object(scene, selection.index, item)


def _name_of(scene: Scene, selection: Selection) -> str:
    items = scene.lights if selection.kind == "light" else scene.objects
    return items[selection.index].name


def _spheres(scene: Scene, selection: Selection) -> list[tuple[Vec3, float]]:
    """Return bounding spheres of what is selected, or of all but the planes if nothing is."""
    if selection.kind == "light":
        return [edits.bounds_of(scene.lights[selection.index])]
    if selection.kind == "object":
        return [_object_sphere(scene, selection.index)]
    spheres = [edits.bounds_of(light) for light in scene.lights]
    spheres += [
        _object_sphere(scene, index)
        for index, item in enumerate(scene.objects)
        if item.mesh != "plane"
    ]
    return spheres


def _object_sphere(scene: Scene, index: int) -> tuple[Vec3, float]:
    world = np.array(_box_corners(scene, index))
    centre = (world.max(0) + world.min(0)) / 2.0
    x, y, z = centre.tolist()
    return (x, y, z), float(np.linalg.norm(world - centre, axis=-1).max())


def _box_corners(scene: Scene, index: int) -> list[Vec3]:
    """Return the world corners of an object's box; bits 1, 2, 4 of the index choose x, y, z.

    Raises
    ------
    InputError
        If the mesh cannot be loaded.
    """
    item = scene.objects[index]
    bounds = np.asarray(load_mesh(item.mesh).bounds, dtype=np.float64)
    matrix = world_from_object(item.transform)
    corners: list[Vec3] = []
    for i in range(8):
        point = np.array([bounds[i & 1, 0], bounds[i >> 1 & 1, 1], bounds[i >> 2 & 1, 2]])
        x, y, z = (matrix[:3, :3] @ point + matrix[:3, 3]).tolist()
        corners.append((x, y, z))
    return corners
