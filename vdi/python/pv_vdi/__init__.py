"""Volumetric Depth Images in Python.

    import pv_vdi
    vdi = pv_vdi.read("vdi_000100.vdi")
    vdi.segments["front"][vdi.offsets[0]:vdi.offsets[1]]      # the depths at which the first list's supersegments begin
    picture, depth = vdi.render(vdi.camera.azimuth(20.0))     # float32, [height][width][4] and [height][width]

Reading and rendering need neither VTK nor ParaView. pv_vdi.catalyst hands a simulation's arrays to the in situ engine, which
makes VDIs by scripts in ParaView or by a JSON text.
"""

import json

from ._core import Camera, Error, Renderer, read as _read_lists

__all__ = ["Camera", "Error", "Vdi", "read"]


class Vdi:
    """A VDI, as stored in a file. It doesn't change; its arrays are read-only.

    List (x, y), row 0 at the bottom, has the index i = y * width + x and holds the supersegments
    segments[offsets[i]:offsets[i + 1]], front to back.
    """

    def __init__(self, lists):
        self._lists = lists
        self._segments = None
        self._renderer = None

    @property
    def camera(self):
        """The viewpoint at which the VDI was made, V_O."""
        return self._lists.camera

    @property
    def width(self):
        """Lists in a row, those of the margin included."""
        return self._lists.width

    @property
    def height(self):
        return self._lists.height

    @property
    def margin(self):
        """Lists on either side of the picture that the camera frames: (x, y)."""
        return self._lists.margin

    @property
    def size(self):
        """Width and height of the picture that the camera frames."""
        return self.width - 2 * self.margin[0], self.height - 2 * self.margin[1]

    @property
    def budget(self):
        """The most supersegments that a list may hold."""
        return self._lists.budget

    @property
    def bounds(self):
        """Low and high corner of the scene, world coordinates."""
        return self._lists.bounds

    @property
    def time(self):
        """The simulation's time; 0 if it is unknown."""
        return self._lists.time

    @property
    def time_step(self):
        return self._lists.time_step

    @property
    def precision(self):
        """"full" or "compact": how the supersegments are stored."""
        return self._lists.precision

    @property
    def metadata(self):
        """The meaning of the colours, as a dict (docs/format.md has the fields); None if the file lacks it."""
        text = self._lists.metadata_text
        return None if text is None else json.loads(text)

    @property
    def offsets(self):
        """uint32, one more than there are lists; a view of the VDI's memory."""
        return self._lists.offsets

    @property
    def segments(self):
        """A structured array with the float32 fields front, back (view-space depths of V_O, world units), red, green, blue
        (premultiplied, accumulated over the interval) and opacity. A copy if the precision is compact, else a view."""
        if self._segments is None:
            segments = self._lists.segments()
            segments.flags.writeable = False
            self._segments = segments
        return self._segments

    def render(self, camera=None, size=None, reconstruction="sheared"):
        """The picture from a camera, by default V_O, of (width, height) pixels, by default those of V_O's picture.

        Returns colours, float32 [height][width][4], premultiplied RGBA, and depths, float32 [height][width], view-space,
        infinity where the picture is empty. Row 0 is the top row, as in image files. `reconstruction` is "sheared", "smooth" or
        "constant". Renders on the device that VDI_DEVICE names, or the best one. Threads may call it at the same time;
        they take turns.
        Raises Error for an unusable camera, and if no device is usable.
        """
        if self._renderer is None:
            self._renderer = Renderer(self._lists)
        colors, depths = self._renderer.render(camera, size, reconstruction)
        return colors[::-1], depths[::-1]

    def write(self, path):
        """Writes a .vdi file. An existing file is replaced at once, or stays if writing fails."""
        self._lists.write(path)

    def __repr__(self):
        return "<pv_vdi.Vdi of %d x %d lists, %d supersegments>" % (self.width, self.height, self.offsets[-1])


def read(path):
    """Reads a .vdi file. Raises Error, which names the file, if the file is missing or damaged."""
    return Vdi(_read_lists(path))
