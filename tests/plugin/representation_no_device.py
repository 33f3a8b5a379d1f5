"""A .vdi file shown where there's no Vulkan device (VK_ICD_FILENAMES names none): a message names the remedy."""

import os
import sys

import pvtest
from paraview import simple
from pvtest import check

view = pvtest.make_view([480, 360], [2.2, 1.9, 2.4], [0.5, 0.5, 0.5])
simple.Show(simple.OpenDataFile(sys.argv[1]), view)
for _ in range(3):
    simple.Render(view)
path = os.path.join(pvtest.OUTPUT, "no_device.png")
simple.SaveScreenshot(path, view, ImageResolution=[480, 360])
check(pvtest.read_png(path).std() > 5, "the view shows a message")
check("mesa-vulkan-drivers" in pvtest.message_in(view), "the message names the package that helps")
pvtest.finish()
