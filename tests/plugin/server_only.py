"""pvpython as a client without the plugin, whose server has it: other data are shown as ever. ParaView ended by itself, for
their representation had a part that this client can't make."""

import os
import socket
import subprocess

from paraview import simple

with socket.socket() as probe:
    probe.bind(("127.0.0.1", 0))
    port = str(probe.getsockname()[1])
server = subprocess.Popen([os.environ["PVSERVER"], "--reverse-connection", "--client-host=127.0.0.1", "--server-port=" + port],
                          env=dict(os.environ, PV_PLUGIN_CONFIG_FILE=os.environ["VDI_PLUGIN_LIST"]), stdin=subprocess.DEVNULL)
try:
    simple.ReverseConnect(port)
    assert hasattr(simple.servermanager.filters, "VolumetricDepthImage"), "the server has the plugin"
    view = simple.CreateRenderView()
    simple.Show(simple.Wavelet(), view).SetRepresentationType("Surface")
    simple.Render(view)
    assert view.GetRenderWindow().GetSize()[0] > 0
finally:
    server.terminate()
    server.wait(20)
print("the wavelet was shown")
