#include "VDIServer.h"

#include <poll.h>
#include <vtkClientSocket.h>
#include <vtkCommand.h>
#include <vtkMultiProcessController.h>
#include <vtkPVSession.h>
#include <vtkSMProperty.h>
#include <vtkSMProxy.h>
#include <vtkSMSession.h>
#include <vtkSocketCommunicator.h>

#include <array>

namespace pv {

namespace {

/// The connections to the data server and the render server, which may be one; null if there is none.
std::array<vtkSocketCommunicator*, 2> connectionsOf(vtkSMSession* session) {
  const auto connection = [session](vtkPVSession::ServerFlags server) {
    vtkMultiProcessController* controller = session != nullptr ? session->GetController(server) : nullptr;
    return vtkSocketCommunicator::SafeDownCast(controller != nullptr ? controller->GetCommunicator()
                                                                     : nullptr);
  };
  return {connection(vtkPVSession::DATA_SERVER_ROOT), connection(vtkPVSession::RENDER_SERVER_ROOT)};
}

bool stands(vtkSocketCommunicator* connection) {
  vtkClientSocket* socket = connection->GetSocket();
  if (socket == nullptr || socket->GetConnected() == 0) return false;
  pollfd state{.fd = socket->GetSocketDescriptor(), .events = POLLRDHUP, .revents = 0};
  return poll(&state, 1, 0) <= 0;  // only the end of the connection or an error is reported
}

}  // namespace

bool isConnected(vtkSMSession* session) {
  for (vtkSocketCommunicator* connection : connectionsOf(session)) {
    if (connection != nullptr && !stands(connection)) return false;
  }
  return true;
}

void sayLost(vtkSMSession* session) {
  for (vtkSocketCommunicator* connection : connectionsOf(session)) {
    if (connection == nullptr || stands(connection)) continue;
    connection->InvokeEvent(vtkCommand::ErrorEvent);  // as the connection itself does at the next question
    return;
  }
}

vtkSMProperty* asked(vtkSMProxy* proxy, const char* property) {
  vtkSMProperty* value = proxy->GetProperty(property);
  if (value != nullptr && isConnected(proxy->GetSession())) proxy->UpdatePropertyInformation(value);
  return value;
}

void command(vtkSMProxy* proxy, const char* name) {
  if (isConnected(proxy->GetSession())) proxy->InvokeCommand(name);
}

}  // namespace pv
