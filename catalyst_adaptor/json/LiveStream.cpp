#include "catalyst_adaptor/json/LiveStream.h"

#include <fmt/format.h>

#include <cstdint>
#include <cstdio>
#include <string>
#include <utility>

#include "vdi/core/Error.h"
#include "vdi/page/Page.h"
#include "vdi/stream/GivenToken.h"
#include "vdi/stream/Publisher.h"
#include "vdi/stream/SecretFile.h"
#include "vdi/stream/Server.h"
#include "vdi/stream/Token.h"

namespace vdi::catalyst {

/// The members' order lets the publisher hand its last frame over before the server ends.
struct LiveStream::Service {
  Service(stream::ServerOptions options, bool isSteered)
      : server(steered(std::move(options), isSteered)), publisher(server) {}
  stream::ServerOptions steered(stream::ServerOptions options, bool isSteered) {
    if (isSteered)
      options.steer = [this](std::uint32_t viewer, const stream::Wish& wish) { wishes.put(viewer, wish); };
    return options;
  }

  stream::Wishes wishes;  // the server's thread uses it
  stream::Server server;
  stream::Publisher publisher;
  std::unique_ptr<stream::SecretFile> link;
  std::string told;  // the publisher's problem reported last
};

LiveStream::LiveStream(const config::RunStream& options) {
  constexpr double bytesPerMegabit = 1e6 / 8.0;
  const std::string given = stream::givenToken(options.tokenFile);
  stream::ServerOptions server;
  server.host = options.host;
  server.port = options.port;
  server.token = given.empty() ? stream::randomToken() : given;
  server.page = page::emptyPage("Live");
  server.mostBytesPerSecond = options.megabits * bytesPerMegabit;
  server.certificate = options.certificate;
  server.key = options.key;
  service_ = std::make_unique<Service>(std::move(server), options.steer);
  const std::string link = given.empty() ? service_->server.link() : service_->server.address();
  const std::string& file = options.linkFile;
  if (!file.empty()) service_->link = std::make_unique<stream::SecretFile>(file, link);
  // The token stays out of logs. The user has it in the file or chose it.
  fmt::print(stderr, "vdi_catalyst: serving at {}{}\n", service_->server.address(),
             file.empty() ? "" : "; the link is in " + file);
}

LiveStream::~LiveStream() = default;

void LiveStream::publish(std::shared_ptr<const Vdi> vdi) {
  service_->publisher.publish(std::move(vdi));
  const std::string trouble = service_->publisher.trouble();
  if (trouble == service_->told) return;
  service_->told = trouble;
  throw Error(ErrorCode::Format, "a VDI couldn't be sent: " + trouble);
}

std::uint64_t LiveStream::dropped() const {
  return service_->publisher.dropped();
}

std::optional<stream::SteeringRequest> LiveStream::takeRequest(std::chrono::milliseconds patience) {
  return service_->wishes.take(patience);
}

void LiveStream::setControls(stream::Controls controls) {
  service_->server.setControls(std::move(controls));
}

}  // namespace vdi::catalyst
