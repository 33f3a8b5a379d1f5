// The plugin's questions to the server of a proxy. A server may die at any moment. ParaView then offers to
// save the state, in a dialog that opens within whatever question found the server dead. The window's timers
// run beside that dialog, and ParaView's client aborts if one of them asks the dead server for a value.
// Everything in the plugin that asks on its own accord therefore asks by these functions.
#ifndef VDIServer_h
#define VDIServer_h

class vtkSMProperty;
class vtkSMProxy;
class vtkSMSession;

namespace pv {

/// Whether the connections to the session's servers stand; true if it has none. Takes microseconds, and asks
/// no server.
bool isConnected(vtkSMSession* session);
/// Lets ParaView find out that the server is gone. ParaView opens its dialog within this call.
void sayLost(vtkSMSession* session);

/// The property of that name, with the server's value. It keeps its last value if the server is gone.
vtkSMProperty* asked(vtkSMProxy* proxy, const char* property);
/// Has the server carry out a command of the proxy; does nothing if the server is gone.
void command(vtkSMProxy* proxy, const char* name);

}  // namespace pv

#endif
