"""Compares a view of the window with the tool's picture of the same VDI for that camera. The camera
comes from a state file that was saved by mouse."""

import os
import subprocess
import xml.etree.ElementTree

import numpy as np
import skimage.io
from window import ssim


def view_in(state):
    """The properties of the one render view in a state file: name to texts."""
    views = [proxy for proxy in xml.etree.ElementTree.parse(state).iter("Proxy") if proxy.get("type") == "RenderView"]
    assert len(views) == 1, "%s has %d render views" % (state, len(views))
    return {each.get("name"): [element.get("value") for element in each.iter("Element")]
            for each in views[0].iter("Property")}


def tools_picture(vdi, view, path):
    """The tool's picture over black, [rows][columns][3] in 0 to 255."""
    assert view["CameraParallelProjection"][0] == "0"
    subprocess.run([os.environ["VDI_TOOL"], "render", vdi, "-o", path, "--resolution", "x".join(view["ViewSize"]),
                    "--position", *view["CameraPosition"], "--focal-point", *view["CameraFocalPoint"],
                    "--view-up", *view["CameraViewUp"], "--view-angle", *view["CameraViewAngle"]], check=True,
                   stdout=subprocess.DEVNULL)
    return skimage.io.imread(path)[..., :3].astype(float)


def likeness(screenshot, box, vdi, state, kept):
    """SSIM of the middle of the view in `screenshot` and of the tool's picture; the view's background is black. `box`: left,
    top, width and height of the view in it, to some pixels. `kept`: the compared pictures' path, without ".png"."""
    expected = tools_picture(vdi, view_in(state), kept + "_tool.png")
    screen = skimage.io.imread(screenshot)[..., :3].astype(float)
    left, top = box[:2]

    def middle_of(image, row, column):
        rows, columns = expected.shape[:2]
        return image[row + rows // 4:row + rows - rows // 4, column + columns // 4:column + columns - columns // 4]

    inner = middle_of(expected, 0, 0)
    assert inner.std() > 10, "the tool's picture shows next to nothing"
    # The view is where its picture fits best: frames of windows are some pixels wide.
    places = [(row, column) for row in range(top - 8, top + 9) for column in range(left - 8, left + 9)]
    row, column = min(places, key=lambda place: np.abs(middle_of(screen, *place)[::4, ::4] - inner[::4, ::4]).mean())
    seen = middle_of(screen, row, column)
    for picture, name in ((seen, "_seen.png"), (inner, "_expected.png")):
        skimage.io.imsave(kept + name, np.rint(picture).astype(np.uint8), check_contrast=False)
    return ssim(kept + "_seen.png", kept + "_expected.png")
