"""pvpython as a client without the plugin, whose server has it, must still show other data. ParaView used to end,
because the representation of these data had a part that such a client can't make."""

import os
import sys

from paraview import simple

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import server  # noqa: E402

port = server.free_port()
pvserver = server.start_reverse(port, env=server.clean_environment(PV_PLUGIN_CONFIG_FILE=os.environ["VDI_PLUGIN_LIST"]))
try:
    simple.ReverseConnect(port)
    assert hasattr(simple.servermanager.filters, "VolumetricDepthImage"), "the server has the plugin"
    view = simple.CreateRenderView()
    simple.Show(simple.Wavelet(), view).SetRepresentationType("Surface")
    simple.Render(view)
    assert view.GetRenderWindow().GetSize()[0] > 0
finally:
    server.end(pvserver)
print("the wavelet was shown")
