#include "apps/commands/file_server.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <optional>
#include <thread>

#include "data/core/error.h"
#include "tests/testing/temp_folder.h"

namespace slcmap::inline commands {}  // namespace slcmap::commands

namespace slcmap {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using testing::MessageOf;
using ::testing::StartsWith;
using testing::TempFolder;

// A connection to a port of this computer.
class Connection {
 public:
  explicit Connection(int port) : socket_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<uint16_t>(port));
    EXPECT_EQ(connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  }
  ~Connection() { close(socket_); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void Send(const std::string& bytes) const {
    EXPECT_EQ(send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL), std::ssize(bytes));
  }

  // Until the server ends it, or there are so many answers.
  std::string Receive(int answers = 1) const {
    std::string bytes;
    char part[65536];
    while (!IsWhole(bytes, answers)) {
      const ssize_t got = recv(socket_, part, sizeof part, 0);
      if (got <= 0) break;
      bytes.append(part, static_cast<std::size_t>(got));
    }
    return bytes;
  }

 private:
  static bool IsWhole(const std::string& bytes, int answers) {
    std::size_t at = 0;
    for (int i = 0; i < answers; ++i) {
      const std::size_t head = bytes.find("\r\n\r\n", at),
                        told = bytes.find("Content-Length: ", at);
      if (head == bytes.npos) return false;
      at = head + 4 + std::stoul(bytes.substr(told + 16));
    }
    return bytes.size() >= at;
  }

  const int socket_;
};

class FileServerTest : public ::testing::Test {
 protected:
  FileServerTest() {
    folder_.Write("site/tileset.json", "{\"asset\": 1}");
    folder_.Write("site/a folder/0_0.glb", "0123456789");
    folder_.Write("secret.txt", "secret");
    std::filesystem::create_symlink(folder_.Path("secret.txt"), folder_.Path("site/link.txt"));
    server_.emplace(folder_.Path("site"), 0, std::map<std::string, std::string>{{"/", "<html>"}});
    thread_ = std::thread([this] { server_->Run([this] { return stop_.load(); }); });
  }
  ~FileServerTest() override {
    stop_ = true;
    thread_.join();
  }

  std::string Ask(const std::string& first, const std::string& more = "") const {
    const Connection connection(server_->port());
    connection.Send(first + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(server_->port()) +
                    "\r\n" + more + "\r\n");
    return connection.Receive();
  }

  TempFolder folder_;
  std::optional<FileServer> server_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

TEST_F(FileServerTest, GivesFilesAndPages) {
  EXPECT_THAT(Ask("GET /tileset.json?v=1"),
              AllOf(StartsWith("HTTP/1.1 200 OK\r\n"), HasSubstr("application/json"),
                    EndsWith("\r\n\r\n{\"asset\": 1}")));
  EXPECT_THAT(Ask("GET /a%20folder/0_0.glb"), AllOf(HasSubstr("gltf"), EndsWith("0123456789")));
  EXPECT_THAT(Ask("GET /"), AllOf(HasSubstr("text/html"), EndsWith("<html>")));
  EXPECT_THAT(Ask("GET /none.glb"), StartsWith("HTTP/1.1 404"));
  EXPECT_THAT(Ask("GET /a%20folder"), StartsWith("HTTP/1.1 404"));
}

TEST_F(FileServerTest, GivesRanges) {
  const std::string file = "GET /a%20folder/0_0.glb";
  EXPECT_THAT(Ask(file, "Range: bytes=2-4\r\n"),
              AllOf(StartsWith("HTTP/1.1 206"), HasSubstr("Content-Range: bytes 2-4/10\r\n"),
                    EndsWith("\r\n\r\n234")));
  EXPECT_THAT(Ask(file, "Range: bytes=7-\r\n"), EndsWith("\r\n\r\n789"));
  EXPECT_THAT(Ask(file, "Range: bytes=-2\r\n"), EndsWith("\r\n\r\n89"));
  EXPECT_THAT(Ask(file, "Range: bytes=8-99\r\n"), EndsWith("\r\n\r\n89"));
}

TEST_F(FileServerTest, StaysInItsFolder) {
  for (const char* path : {"/../secret.txt", "/%2e%2e/secret.txt", "/a%20folder/../../secret.txt",
                           "/..%2fsecret.txt", "/link.txt"}) {
    EXPECT_THAT(Ask(std::string("GET ") + path), StartsWith("HTTP/1.1 404")) << path;
  }
  EXPECT_THAT(Ask("GET /tileset.json%00.txt"), StartsWith("HTTP/1.1 404"));
  EXPECT_THAT(Ask("GET tileset.json"), StartsWith("HTTP/1.1 404"));
}

TEST_F(FileServerTest, RefusesOtherHostsAndMethods) {
  EXPECT_THAT(Ask("POST /tileset.json"), StartsWith("HTTP/1.1 405"));
  const Connection connection(server_->port());
  connection.Send("GET /tileset.json HTTP/1.1\r\nHost: evil.example\r\n\r\n");
  EXPECT_THAT(connection.Receive(), StartsWith("HTTP/1.1 403"));
  const Connection endless(server_->port());
  endless.Send("GET /" + std::string(20000, 'a'));
  EXPECT_EQ(endless.Receive(), "");
}

TEST_F(FileServerTest, AnswersOneAfterTheOtherAndBesideThoseWhoSayNothing) {
  const Connection silent(server_->port()), slow(server_->port());
  slow.Send("GET /tileset.json HTTP/1.1\r\nHo");
  const std::string request = "GET /tileset.json HTTP/1.1\r\nHost: localhost\r\n\r\n";
  const Connection connection(server_->port());
  connection.Send(request + "HEAD" + request.substr(3) + request);
  const std::string answers = connection.Receive(1);
  EXPECT_THAT(answers, StartsWith("HTTP/1.1 200"));
  slow.Send("st: localhost\r\n\r\n");
  EXPECT_THAT(slow.Receive(), EndsWith("{\"asset\": 1}"));
}

TEST_F(FileServerTest, APortInUseAndAMissingFolderAreNamed) {
  EXPECT_THAT(MessageOf<ConfigError>([&] { FileServer(folder_.Path(), server_->port(), {}); }),
              AllOf(HasSubstr("port: found " + std::to_string(server_->port())),
                    HasSubstr("expected a free one")));
  EXPECT_THAT(MessageOf<DataError>([&] { FileServer(folder_.Path("none"), 0, {}); }),
              HasSubstr("found no folder"));
}

}  // namespace
}  // namespace slcmap
