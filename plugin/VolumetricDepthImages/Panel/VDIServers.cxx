#include "VDIServers.h"

#include <pqServer.h>
#include <QTimer>
#include <QVariant>

#include "VDIServer.h"

namespace pv {

bool mayAsk(pqServer* server) {
  if (server->isProgressPending()) return false;
  if (isConnected(server->session())) return true;
  constexpr const char* said = "VDISaidLost";
  if (!server->property(said).toBool()) {
    server->setProperty(said, true);
    QTimer::singleShot(0, server, [server] { sayLost(server->session()); });
  }
  return false;
}

}  // namespace pv
