// Server and client of the library, over the loopback address.
#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509v3.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <fstream>

#include "tests/Catch.h"
#include "tests/FuzzTime.h"
#include "tests/TemporaryFolder.h"
#include "tests/Thrown.h"
#include "tests/io/Samples.h"
#include "vdi/core/Thinning.h"
#include "vdi/io/VdiFile.h"
#include "vdi/stream/Client.h"
#include "vdi/stream/Publisher.h"
#include "vdi/stream/Server.h"
#include "vdi/stream/Token.h"

using namespace vdi;
using namespace vdi::stream;

namespace {

using namespace std::chrono_literals;

constexpr auto patience = 60s;

ServerOptions options() {
  ServerOptions result;
  result.token = randomToken();
  result.page = "<p>page</p>";
  return result;
}

ClientOptions clientOf(const Server& server) {
  ClientOptions result;
  result.url = parseUrl(server.link());
  return result;
}

std::shared_ptr<const Vdi> vdiOfStep(std::uint64_t step, int width = 40) {
  Vdi vdi = test::plausibleVdi(width, 30, 8);
  vdi.timeStep = step;
  return std::make_shared<const Vdi>(std::move(vdi));
}

Received nextOf(Client& client) {
  std::optional<Received> received = client.next(patience);
  REQUIRE(received);
  return *std::move(received);
}

[[maybe_unused]] std::size_t residentBytes() {
  std::size_t all = 0;
  std::size_t resident = 0;
  std::ifstream("/proc/self/statm") >> all >> resident;
  return resident * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

/// Writes a key and a self-signed certificate for that name.
void writeCertificate(const std::filesystem::path& key, const std::filesystem::path& certificate,
                      const char* name) {
  EVP_PKEY* const pair = EVP_EC_gen("P-256");
  X509* const x509 = X509_new();
  X509_set_version(x509, 2);
  ASN1_INTEGER_set(X509_get_serialNumber(x509), 1);
  X509_gmtime_adj(X509_getm_notBefore(x509), -3600);
  X509_gmtime_adj(X509_getm_notAfter(x509), 3600);
  X509_set_pubkey(x509, pair);
  X509_NAME* const subject = X509_get_subject_name(x509);
  X509_NAME_add_entry_by_txt(subject, "CN", MBSTRING_ASC, reinterpret_cast<const unsigned char*>(name), -1,
                             -1, 0);
  X509_set_issuer_name(x509, subject);
  X509_EXTENSION* const names =
      X509V3_EXT_conf_nid(nullptr, nullptr, NID_subject_alt_name, (std::string("IP:") + name).c_str());
  X509_add_ext(x509, names, -1);
  X509_EXTENSION_free(names);
  X509_sign(x509, pair, EVP_sha256());
  std::FILE* file = std::fopen(key.c_str(), "w");
  PEM_write_PrivateKey(file, pair, nullptr, nullptr, 0, nullptr, nullptr);
  std::fclose(file);
  file = std::fopen(certificate.c_str(), "w");
  PEM_write_X509(file, x509);
  std::fclose(file);
  X509_free(x509);
  EVP_PKEY_free(pair);
}

}  // namespace

TEST_CASE("what is published arrives") {
  Server server(options());
  Client client(clientOf(server));
  Publisher publisher(server);
  for (std::uint64_t step = 1; step <= 3; ++step) {
    const auto vdi = vdiOfStep(step);
    publisher.publish(vdi);
    const Received received = nextOf(client);
    CHECK(received.level.step == step);
    CHECK(received.level.levels == 1);
    CHECK(received.file == io::encode(*vdi));
  }
  CHECK(client.standing().state.phase == Phase::Live);
  CHECK(server.status().frames == 3);
  CHECK(server.status().viewers == 1);
  CHECK(publisher.trouble().empty());
}

TEST_CASE("a large VDI comes coarse, then in full") {
  Server server(options());
  Client client(clientOf(server));
  Publisher publisher(server);
  const auto vdi = std::make_shared<const Vdi>(test::noisyVdi(150, 100, 12));
  publisher.publish(vdi);
  const Received coarse = nextOf(client);
  CHECK(coarse.level.level == 0);
  CHECK(coarse.level.levels == 2);
  CHECK(coarse.level.width == 50);
  const Vdi few = io::decode(coarse.file);
  const auto& all = std::get<SupersegmentLists>(vdi->lists);
  const auto& some = std::get<SupersegmentLists>(few.lists);
  // The centre of each 3 x 3.
  const auto expected = all.list(std::size_t{(3 * 7 + 1) * 150} + 3 * 20 + 1);
  const auto found = some.list(std::size_t{7 * 50} + 20);
  CHECK(std::vector(found.begin(), found.end()) == std::vector(expected.begin(), expected.end()));
  const Received full = nextOf(client);
  CHECK(io::decode(full.file) == *vdi);
}

TEST_CASE("a client decodes VDIs while they arrive") {
  Server server(options());
  ClientOptions decoding = clientOf(server);
  decoding.decodes = true;
  Client client(decoding);
  Publisher publisher(server);
  const auto vdi = std::make_shared<const Vdi>(test::noisyVdi(700, 500, 12));  // consists of many parts
  publisher.publish(vdi);
  std::uint32_t level = 0;
  for (const int factor : {9, 5, 3, 1}) {
    Received received = nextOf(client);
    CHECK(received.level.level == level++);
    CHECK(received.level.levels == 4);
    CHECK(received.file.empty());
    CHECK(received.decode() == thinned(*vdi, factor));
  }
}

TEST_CASE("publishing waits for no encoder") {
  Server server(options());
  Publisher publisher(server);
  const auto vdi = std::make_shared<const Vdi>(test::noisyVdi(300, 200, 20));
  const auto last = vdiOfStep(99);
  const auto before = Clock::now();
  for (int i = 0; i < 1000; ++i) publisher.publish(vdi);
  publisher.publish(last);
  CHECK(Clock::now() - before < 5s);  // a thousand encodings take minutes
  CHECK(publisher.dropped() > 900);
  Client client(clientOf(server));
  while (nextOf(client).level.step != 99) {
  }
}

#ifndef __SANITIZE_ADDRESS__  // it keeps freed memory for a while
TEST_CASE("frames leave no memory behind") {
  constexpr std::uint64_t atFirst = 200;  // until buffers have grown
  constexpr std::uint64_t atLeast = 500;
  constexpr std::size_t enough = std::size_t{8} << 20;
  Server server(options());
  Client client(clientOf(server));
  Publisher publisher(server);
  std::size_t before = 0;
  const test::FuzzTime time(0.0);
  for (std::uint64_t step = 1; step < atLeast || !time.isOver(); ++step) {
    publisher.publish(vdiOfStep(step, 80));
    while (nextOf(client).level.step != step) {
    }
    if (step == atFirst) before = residentBytes();
    if (step > atFirst) REQUIRE(residentBytes() < before + enough);
  }
}
#endif

TEST_CASE("the last VDI is sent before the end") {
  Server server(options());
  Client client(clientOf(server));
  {
    Publisher publisher(server);
    publisher.publish(vdiOfStep(1));
  }
  CHECK(server.status().frames == 1);
  CHECK(nextOf(client).level.step == 1);
}

TEST_CASE("a client comes back to a server that was started again") {
  ServerOptions again = options();
  auto first = std::make_unique<Server>(again);
  again.port = first->port();
  Client client(clientOf(*first));
  {
    Publisher publisher(*first);
    publisher.publish(vdiOfStep(1));
  }
  CHECK(nextOf(client).level.step == 1);
  const std::string session = client.standing().session;
  first.reset();
  CHECK_FALSE(client.next(100ms));
  const Server second(again);
  Publisher publisher(const_cast<Server&>(second));
  publisher.publish(vdiOfStep(2));
  CHECK(nextOf(client).level.step == 2);
  CHECK(client.standing().session != session);
}

TEST_CASE("a client asks a server that was started again for its frame once the series has it") {
  std::atomic<int> asked = 0;
  ServerOptions again = options();
  again.show = [&asked](std::uint32_t index) { asked += index == 2 ? 1 : 100; };
  auto first = std::make_unique<Server>(again);
  again.port = first->port();
  const Series one{{0.5}, {7}};
  for (int i = 0; i < 3; ++i) first->append(one);
  Client client(clientOf(*first));
  const auto comes = [&client](const auto& condition) {
    const auto end = Clock::now() + patience;
    while (!condition() && Clock::now() < end) CHECK_FALSE(client.next(10ms));
    return condition();
  };
  client.show(2);
  REQUIRE(comes([&] { return asked == 1; }));
  const std::string session = client.standing().session;
  first.reset();

  // The new server answers before it has listed its files.
  Server second(again);
  REQUIRE(comes([&] { return client.standing().hasState && client.standing().session != session; }));
  CHECK(client.standing().series == std::nullopt);
  second.append(one);
  second.append(one);
  REQUIRE(comes([&] { return client.standing().series == 2; }));
  CHECK(asked == 1);
  second.append(one);
  REQUIRE(comes([&] { return asked == 2; }));
  passFrame(io::encode(*vdiOfStep(7)), 2, Clock::now(),
            [&second](FramePtr frame) { second.provide(std::move(frame)); });
  CHECK(nextOf(client).level.frame == 2);
  CHECK(asked == 2);
}

TEST_CASE("a client tells a server that was live from a finished series") {
  auto server = std::make_unique<Server>(options());
  Client client(clientOf(*server));
  server->append({{0.5}, {7}});
  passFrame(io::encode(*vdiOfStep(7)), 0, Clock::now(),
            [&server](FramePtr frame) { server->publish(std::move(frame)); });
  CHECK(nextOf(client).level.frame == 0);
  CHECK(client.standing().hasBeenLive);
  server.reset();
  const auto end = Clock::now() + patience;
  while (client.standing().isConnected && Clock::now() < end) CHECK_FALSE(client.next(10ms));
  CHECK(client.standing().state.phase == Phase::Ended);
  CHECK(client.standing().hasBeenLive);

  Server finished(options());
  finished.append({{0.5}, {7}});
  finished.setPhase(Phase::Ended);
  passFrame(io::encode(*vdiOfStep(7)), 0, Clock::now(),
            [&finished](FramePtr frame) { finished.publish(std::move(frame)); });
  Client other(clientOf(finished));
  CHECK(nextOf(other).level.frame == 0);
  CHECK(other.standing().hasState);
  CHECK_FALSE(other.standing().hasBeenLive);
}

TEST_CASE("a wrong token and a foreign server end a client") {
  Server server(options());
  ClientOptions wrong = clientOf(server);
  wrong.url.token = randomToken();
  Client client(wrong);
  const Error error = test::errorOf([&] { client.next(patience); });
  CHECK(error.code() == ErrorCode::InvalidArgument);
  CHECK(std::string(error.what()).find(wrong.url.token) == std::string::npos);
  CHECK(test::errorOf([&] { client.next(patience); }).code() == ErrorCode::InvalidArgument);
}

TEST_CASE("encrypted, for those who trust the certificate") {
  const test::TemporaryFolder folder;
  const auto path = [&folder](const char* name) { return folder.path() / name; };
  writeCertificate(path("key.pem"), path("cert.pem"), "127.0.0.1");
  writeCertificate(path("other-key.pem"), path("other.pem"), "192.0.2.1");
  ServerOptions encrypted = options();
  encrypted.certificate = path("cert.pem");
  encrypted.key = path("key.pem");
  Server server(encrypted);
  Publisher publisher(server);
  const auto vdi = vdiOfStep(5);
  publisher.publish(vdi);
  CHECK(server.address().rfind("https://", 0) == 0);
  ClientOptions trusting = clientOf(server);
  trusting.authority = path("cert.pem");
  Client client(trusting);
  CHECK(nextOf(client).file == io::encode(*vdi));
  Client stranger(clientOf(server));
  CHECK(test::errorOf([&] { stranger.next(patience); }).code() == ErrorCode::Io);

  // A certificate of another host.
  encrypted.certificate = path("other.pem");
  encrypted.key = path("other-key.pem");
  Server impostor(encrypted);
  ClientOptions careful = clientOf(impostor);
  careful.authority = path("other.pem");
  Client deceived(careful);
  CHECK(test::errorOf([&] { deceived.next(patience); }).code() == ErrorCode::Io);
  // A client without TLS can't connect to a server with TLS.
  ClientOptions plain = clientOf(server);
  plain.url.isEncrypted = false;
  Client lost(plain);
  CHECK_FALSE(lost.next(300ms));

  ServerOptions broken = options();
  broken.certificate = path("cert.pem");
  CHECK(test::errorOf([&] { Server none(broken); }).code() == ErrorCode::InvalidArgument);
  broken.key = path("other-key.pem");
  CHECK(test::errorOf([&] { Server none(broken); }).code() == ErrorCode::Io);
  broken.key = path("nothing.pem");
  CHECK(test::errorOf([&] { Server none(broken); }).code() == ErrorCode::Io);
}

TEST_CASE("what can't be served is refused at once") {
  ServerOptions weak = options();
  weak.token = "short";
  CHECK(test::errorOf([&] { Server none(weak); }).code() == ErrorCode::InvalidArgument);
  Server server(options());
  ServerOptions taken = options();
  taken.port = server.port();
  CHECK(test::errorOf([&] { Server none(taken); }).code() == ErrorCode::Io);
  ServerOptions elsewhere = options();
  elsewhere.host = "192.0.2.1";  // reserved for documentation, so nobody's
  CHECK(test::errorOf([&] { Server none(elsewhere); }).code() == ErrorCode::Io);
}
