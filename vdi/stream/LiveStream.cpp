#include "vdi/stream/LiveStream.h"

#include <fmt/format.h>

#include <cstdint>
#include <cstdio>
#include <string>
#include <utility>

#include "vdi/core/Error.h"
#include "vdi/stream/GivenToken.h"
#include "vdi/stream/Publisher.h"
#include "vdi/stream/SecretFile.h"
#include "vdi/stream/Server.h"
#include "vdi/stream/Token.h"

namespace vdi::stream {

/// The members' order lets the publisher hand its last frame over before the server ends.
struct LiveStream::Service {
  Service(ServerOptions options, bool isSteered)
      : server(steered(std::move(options), isSteered)), publisher(server) {}
  ServerOptions steered(ServerOptions options, bool isSteered) {
    if (isSteered)
      options.steer = [this](std::uint32_t viewer, const Wish& wish) { wishes.put(viewer, wish); };
    return options;
  }

  Wishes wishes;  // the server's thread uses it
  Server server;
  Publisher publisher;
  std::unique_ptr<SecretFile> link;
  std::string told;  // the publisher's problem reported last
};

LiveStream::LiveStream(const LiveOptions& options) {
  constexpr double bytesPerMegabit = 1e6 / 8.0;
  const std::string given = givenToken(options.tokenFile);
  ServerOptions server;
  server.host = options.host;
  server.port = options.port;
  server.token = given.empty() ? randomToken() : given;
  server.page = options.page;
  server.origins = options.origins;
  server.originOption = options.originOption;
  server.embedders = options.embedders;
  server.log = [name = options.programName](const std::string& line) {
    fmt::print(stderr, "{}: {}\n", name, line);
  };
  server.mostBytesPerSecond = options.megabits * bytesPerMegabit;
  server.certificate = options.certificate;
  server.key = options.key;
  service_ = std::make_unique<Service>(std::move(server), options.isSteered);
  const std::string link = given.empty() ? service_->server.link() : service_->server.address();
  const std::string& file = options.linkFile;
  if (!file.empty()) service_->link = std::make_unique<SecretFile>(file, link);
  // The token stays out of logs. The user has it in the file or chose it.
  fmt::print(stderr, "{}: serving at {}{}\n", options.programName, service_->server.address(),
             file.empty() ? "" : "; the link is in " + file);
}

LiveStream::~LiveStream() = default;

void LiveStream::publish(std::shared_ptr<const Vdi> vdi) {
  service_->publisher.publish(std::move(vdi));
}

void LiveStream::requireSent() {
  const std::string trouble = service_->publisher.trouble();
  if (trouble == service_->told) return;
  service_->told = trouble;
  throw Error(ErrorCode::Format, "a VDI couldn't be sent: " + trouble);
}

std::uint64_t LiveStream::dropped() const {
  return service_->publisher.dropped();
}

std::optional<SteeringRequest> LiveStream::takeRequest(std::chrono::milliseconds patience) {
  return service_->wishes.take(patience);
}

void LiveStream::setControls(Controls controls) {
  service_->server.setControls(std::move(controls));
}

}  // namespace vdi::stream
