#include "apps/commands/file_server.h"

#include <httplib.h>
#include <spdlog/fmt/fmt.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <optional>
#include <thread>
#include <vector>

#include "data/core/error.h"

namespace slcmap::inline commands {
namespace {

namespace fs = std::filesystem;

constexpr const char* kThisComputer = "127.0.0.1";
constexpr std::chrono::milliseconds kAskEvery{100};
constexpr time_t kIdle_s = 1;  // without a byte of a request, after which a connection ends
constexpr std::size_t kPart = 1 << 18;  // bytes that are read at once

std::string ContentType(const std::string& path) {
  static const std::map<std::string, std::string> types = {{".html", "text/html; charset=utf-8"},
                                                           {".js", "text/javascript"},
                                                           {".json", "application/json"},
                                                           {".glb", "model/gltf-binary"},
                                                           {".png", "image/png"},
                                                           {".jpg", "image/jpeg"}};
  const auto found = types.find(fs::path(path).extension().string());
  return found == types.end() ? "application/octet-stream" : found->second;
}

// The file that a path of a request means, with all links followed; nothing outside the folder.
std::optional<std::string> PathInFolder(const std::string& folder, const std::string& path) {
  if (path.find('\0') != path.npos) return std::nullopt;
  std::error_code error;
  const fs::path file = fs::canonical(folder + path, error);
  if (error || !fs::is_regular_file(file, error)) return std::nullopt;
  const fs::path within = file.lexically_relative(folder);
  if (within.empty() || *within.begin() == "..") return std::nullopt;
  return file.string();
}

bool IsThisComputer(const std::string& host, int port) {
  for (const char* name : {kThisComputer, "localhost"}) {
    if (host == name || host == fmt::format("{}:{}", name, port)) return true;
  }
  return false;
}

void Refuse(int status, const char* reason, httplib::Response* response) {
  response->status = status;
  response->set_content(reason, "text/plain");
}

// In parts, so that files of any size take no memory.
void SendFile(const std::string& path, httplib::Response* response) {
  const auto file = std::make_shared<std::ifstream>(path, std::ios::binary);
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  if (error || !*file) return Refuse(404, "found no file that can be read\n", response);
  if (size == 0) return response->set_content("", ContentType(path).c_str());
  response->set_content_provider(
      size, ContentType(path).c_str(),
      [file](std::size_t offset, std::size_t length, httplib::DataSink& sink) {
        std::vector<char> part(std::min(length, kPart));
        file->clear();
        file->seekg(static_cast<std::streamoff>(offset));
        file->read(part.data(), static_cast<std::streamsize>(part.size()));
        const auto count = static_cast<std::size_t>(file->gcount());
        return count > 0 && sink.write(part.data(), count);
      });
}

}  // namespace

FileServer::FileServer(const std::string& folder, int port,
                       std::map<std::string, std::string> pages)
    : pages_(std::move(pages)), server_(std::make_unique<httplib::Server>()) {
  std::error_code error;
  folder_ = fs::canonical(folder, error).string();
  if (error || !fs::is_directory(folder_, error)) {
    throw DataError(folder + ": found no folder that can be read, expected one to serve");
  }
  server_->set_keep_alive_timeout(kIdle_s);
  server_->set_read_timeout(kIdle_s);
  server_->set_socket_options([](socket_t socket) {  // as it is, a port may be shared
    const int yes = 1;
    setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  });
  server_->set_pre_routing_handler(
      [this](const httplib::Request& request, httplib::Response& response) {
        using Handled = httplib::Server::HandlerResponse;
        if (!IsThisComputer(request.get_header_value("Host"), port_)) {
          Refuse(403, "expected the host 127.0.0.1 or localhost\n", &response);
          return Handled::Handled;
        }
        if (request.method == "GET" || request.method == "HEAD") return Handled::Unhandled;
        Refuse(405, "expected GET\n", &response);
        return Handled::Handled;
      });
  server_->Get(".*", [this](const httplib::Request& request, httplib::Response& response) {
    const auto page = pages_.find(request.path);
    if (page != pages_.end()) {
      return response.set_content(page->second, "text/html; charset=utf-8");
    }
    const std::optional<std::string> path = PathInFolder(folder_, request.path);
    if (path) return SendFile(*path, &response);
    Refuse(404, "found no such file\n", &response);
  });
  port_ = port == 0 ? server_->bind_to_any_port(kThisComputer)
                    : (server_->bind_to_port(kThisComputer, port) ? port : -1);
  if (port_ > 0) return;
  throw ConfigError(fmt::format(
      "port: found {}, which cannot be had, expected a free one; 0 takes any that is free", port));
}

FileServer::~FileServer() = default;

void FileServer::Run(const std::function<bool()>& stop) {
  std::atomic<bool> has_ended = false;
  std::thread serving([&] {
    server_->listen_after_bind();
    has_ended = true;
  });
  while (!stop() && !has_ended) std::this_thread::sleep_for(kAskEvery);
  while (!has_ended) {  // one that has hardly begun does not hear it
    server_->stop();
    std::this_thread::sleep_for(kAskEvery / 10);
  }
  serving.join();
}

}  // namespace slcmap::commands
