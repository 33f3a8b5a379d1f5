"""Shows the newest .vdi file of a folder in a window, and each new one as it appears, until the
window is closed. The mouse turns it meanwhile. Usage: pvpython follow.py FOLDER"""

import glob
import os
import sys
import time

from paraview.simple import *  # noqa: F403

LoadDistributedPlugin("VolumetricDepthImages", remote=False, ns=globals())
view = CreateView("RenderView", ViewSize=[960, 540])
view.MakeRenderWindowInteractor(True)
window = view.GetInteractor()
window.Initialize()
reader, newest = None, None
while not window.GetDone():
    files = sorted(glob.glob(os.path.join(sys.argv[1], "*.vdi")))
    if files and files[-1] != newest:
        newest = files[-1]
        if reader is None:  # the first VDI: look from its own viewpoint
            reader = VDIReader(FileNames=[newest])
            Show(reader, view)
            viewpoint = [reader.SMProxy.GetProperty("Viewpoint").GetElement(i) for i in range(9)]
            view.CameraPosition, view.CameraFocalPoint = viewpoint[0:3], viewpoint[3:6]
            view.CameraViewUp = viewpoint[6:9]
        reader.FileNames = [newest]
        Render(view)
    window.ProcessEvents()
    time.sleep(0.02)
