// When the window's timers may ask a server. VDIServer.h has the questions.
#ifndef VDIServers_h
#define VDIServers_h

class pqServer;

namespace pv {

/// Whether a timer may ask the server, or draw what the server holds. It may not during the server's work for
/// the window: ParaView's progress bar lets timers run meanwhile, but a filter may be in the middle of an
/// update, which must not begin again. Nor may it once the server is gone. The first call that finds it gone
/// lets ParaView say so as soon as the caller's event has ended. Before, ParaView would say nothing until the
/// user did something that needs the server.
bool mayAsk(pqServer* server);

}  // namespace pv

#endif
