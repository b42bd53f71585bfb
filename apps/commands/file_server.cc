#include "apps/commands/file_server.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <spdlog/fmt/fmt.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "data/core/error.h"

namespace slcmap::inline commands {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostRequest = 16384;  // bytes of a request's head
constexpr std::size_t kMostClients = 64;     // browsers open six a page
constexpr int kAskEvery_ms = 100;
constexpr time_t kSlowest_s = 10;  // for a client to take a part of an answer
constexpr std::size_t kPart = 1 << 18;

// The head of a request, as far as it matters.
struct HttpRequest {
  std::string method, path;  // decoded, without what is behind "?"
  std::string host, range;
};

std::string Lower(std::string_view text) {
  std::string lower(text);
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return lower;
}

std::string_view Trimmed(std::string_view text) {
  const std::size_t from = text.find_first_not_of(" \t"), to = text.find_last_not_of(" \t\r");
  return from == text.npos ? "" : text.substr(from, to - from + 1);
}

// "%20" is a blank; nothing where a "%" has no two digits behind it, or a byte is 0.
std::optional<std::string> PercentDecoded(std::string_view text) {
  std::string decoded;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned value = static_cast<unsigned char>(text[i]);
    if (text[i] == '%') {
      if (i + 2 >= text.size()) return std::nullopt;
      const char* end = text.data() + i + 3;
      if (std::from_chars(text.data() + i + 1, end, value, 16).ptr != end) return std::nullopt;
      i += 2;
    }
    if (value == 0) return std::nullopt;
    decoded.push_back(static_cast<char>(value));
  }
  return decoded;
}

std::optional<HttpRequest> ParseHead(std::string_view head) {
  const std::string_view first = head.substr(0, head.find("\r\n"));
  const std::size_t blank = first.find(' '), second = first.rfind(' ');
  if (blank == first.npos || second <= blank + 1) return std::nullopt;
  HttpRequest request;
  request.method = first.substr(0, blank);
  const std::string_view target = first.substr(blank + 1, second - blank - 1);
  const std::optional<std::string> path = PercentDecoded(target.substr(0, target.find('?')));
  if (!path || !path->starts_with('/')) return std::nullopt;
  request.path = *path;
  for (std::size_t from = first.size(); from + 2 < head.size();) {
    const std::size_t to = std::min(head.find("\r\n", from + 2), head.size());
    const std::string_view row = head.substr(from + 2, to - from - 2);
    const std::size_t colon = row.find(':');
    if (colon != row.npos) {
      const std::string name = Lower(row.substr(0, colon));
      if (name == "host") request.host = Lower(Trimmed(row.substr(colon + 1)));
      if (name == "range") request.range = Trimmed(row.substr(colon + 1));
    }
    from = to;
  }
  return request;
}

// The first and the last byte of "bytes=A-B", "bytes=A-" or "bytes=-LAST" of so many. Nothing of
// what is no single range, which is answered with all; an empty range of one that lies outside.
struct ByteRange {
  int64_t from = 0, to = -1;
};

std::optional<ByteRange> ParseRange(std::string_view text, int64_t size) {
  if (!text.starts_with("bytes=") || text.find(',') != text.npos) return std::nullopt;
  text.remove_prefix(6);
  const std::size_t dash = text.find('-');
  if (dash == text.npos) return std::nullopt;
  const auto number = [](std::string_view digits) -> std::optional<int64_t> {
    int64_t value = 0;
    const auto end = std::from_chars(digits.data(), digits.data() + digits.size(), value).ptr;
    if (digits.empty() || end != digits.data() + digits.size() || value < 0) return std::nullopt;
    return value;
  };
  const auto first = number(text.substr(0, dash)), last = number(text.substr(dash + 1));
  if (!first && !last) return std::nullopt;
  if (!first) return ByteRange{std::max<int64_t>(size - *last, 0), *last > 0 ? size - 1 : -1};
  if (last && *last < *first) return std::nullopt;
  return ByteRange{*first, *first < size ? std::min(last.value_or(size - 1), size - 1) : -1};
}

bool SendAll(int client, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = send(client, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(sent));
  }
  return true;
}

std::string Head(const char* status, const std::string& type, int64_t length,
                 const std::string& more = "") {
  return fmt::format(
      "HTTP/1.1 {}\r\nContent-Type: {}\r\nContent-Length: {}\r\nAccept-Ranges: bytes\r\n"
      "X-Content-Type-Options: nosniff\r\nCache-Control: no-cache\r\n{}\r\n",
      status, type, length, more);
}

// An answer without a file, such as "404 Not Found".
bool SendText(int client, const HttpRequest& request, const char* status, const std::string& type,
              const std::string& text, const std::string& more = "") {
  const std::string head = Head(status, type, std::ssize(text), more);
  return SendAll(client, request.method == "HEAD" ? head : head + text);
}

std::string ContentType(const std::string& path) {
  static const std::map<std::string, std::string> kTypes = {{".html", "text/html; charset=utf-8"},
                                                            {".json", "application/json"},
                                                            {".glb", "model/gltf-binary"},
                                                            {".png", "image/png"},
                                                            {".jpg", "image/jpeg"},
                                                            {".svg", "image/svg+xml"},
                                                            {".pdf", "application/pdf"},
                                                            {".yaml", "text/plain; charset=utf-8"},
                                                            {".csv", "text/csv; charset=utf-8"}};
  const auto known = kTypes.find(fs::path(path).extension());
  return known == kTypes.end() ? "application/octet-stream" : known->second;
}

struct OpenFile {
  explicit OpenFile(const std::string& path) : fd(open(path.c_str(), O_RDONLY | O_CLOEXEC)) {}
  ~OpenFile() {
    if (fd >= 0) close(fd);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  const int fd;
};

bool SendFileRange(int client, int file, ByteRange range) {
  std::vector<char> part(kPart);
  while (range.from <= range.to) {
    const auto want = static_cast<std::size_t>(
        std::min<int64_t>(range.to - range.from + 1, static_cast<int64_t>(kPart)));
    const ssize_t got = pread(file, part.data(), want, range.from);
    if (got <= 0 || !SendAll(client, {part.data(), static_cast<std::size_t>(got)})) return false;
    range.from += got;
  }
  return true;
}

bool SendFile(int client, const HttpRequest& request, const std::string& path) {
  const OpenFile file(path);
  struct stat about {};
  if (file.fd < 0 || fstat(file.fd, &about) != 0 || !S_ISREG(about.st_mode)) {
    return SendText(client, request, "404 Not Found", "text/plain", "found no such file\n");
  }
  const int64_t size = about.st_size;
  const std::optional<ByteRange> range = ParseRange(request.range, size);
  if (range && range->to < 0) {
    return SendText(client, request, "416 Range Not Satisfiable", "text/plain", "",
                    fmt::format("Content-Range: bytes */{}\r\n", size));
  }
  const ByteRange sent = range.value_or(ByteRange{0, size - 1});
  const std::string head =
      range ? Head("206 Partial Content", ContentType(path), sent.to - sent.from + 1,
                   fmt::format("Content-Range: bytes {}-{}/{}\r\n", sent.from, sent.to, size))
            : Head("200 OK", ContentType(path), size);
  if (!SendAll(client, head)) return false;
  return request.method == "HEAD" || SendFileRange(client, file.fd, sent);
}

// The file that a path of a request means, with all links followed; nothing outside the folder.
std::optional<std::string> PathInFolder(const std::string& folder, const std::string& path) {
  std::error_code error;
  const fs::path file = fs::canonical(folder + path, error);
  if (error) return std::nullopt;
  const fs::path within = file.lexically_relative(folder);
  if (within.empty() || *within.begin() == "..") return std::nullopt;
  return file.string();
}

bool IsLocalHost(const std::string& host, int port) {
  for (const char* name : {"127.0.0.1", "localhost"}) {
    if (host == name || host == fmt::format("{}:{}", name, port)) return true;
  }
  return false;
}

}  // namespace

FileServer::FileServer(const std::string& folder, int port,
                       std::map<std::string, std::string> pages)
    : pages_(std::move(pages)) {
  std::error_code error;
  folder_ = fs::canonical(folder, error).string();
  if (error || !fs::is_directory(folder_, error)) {
    throw DataError(folder + ": found no folder that can be read, expected one to serve");
  }
  listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (listener_ < 0) throw Error(fmt::format("socket: {}", std::strerror(errno)));
  const int yes = 1;
  setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<uint16_t>(port));
  socklen_t length = sizeof address;
  auto* any = reinterpret_cast<sockaddr*>(&address);
  if (bind(listener_, any, length) != 0 || listen(listener_, SOMAXCONN) != 0 ||
      getsockname(listener_, any, &length) != 0) {
    const std::string reason = std::strerror(errno);
    close(listener_);
    throw ConfigError(fmt::format(
        "port: found {}, which cannot be had ({}), expected a free one; 0 takes any that is free",
        port, reason));
  }
  port_ = ntohs(address.sin_port);
}

FileServer::~FileServer() { close(listener_); }

void FileServer::Run(const std::function<bool()>& stop) {
  Clients clients;
  while (!stop()) {
    std::vector<pollfd> waited = {{listener_, POLLIN, 0}};
    for (const auto& [client, request] : clients) waited.push_back({client, POLLIN, 0});
    if (poll(waited.data(), waited.size(), kAskEvery_ms) <= 0) continue;
    for (const pollfd& it : waited) {
      if (it.revents == 0) continue;
      if (it.fd == listener_) {
        Accept(&clients);
      } else if (!Read(it.fd, &clients[it.fd])) {
        close(it.fd);
        clients.erase(it.fd);
      }
    }
  }
  for (const auto& [client, request] : clients) close(client);
}

void FileServer::Accept(Clients* clients) const {
  const int client = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
  if (client < 0) return;
  const timeval slowest{kSlowest_s, 0};
  setsockopt(client, SOL_SOCKET, SO_SNDTIMEO, &slowest, sizeof slowest);
  if (clients->size() < kMostClients) {
    clients->emplace(client, "");
  } else {
    close(client);
  }
}

// Takes what has come, and answers the requests that are whole. False where the connection ends.
bool FileServer::Read(int client, std::string* request) const {
  char part[4096];
  const ssize_t got = recv(client, part, sizeof part, MSG_DONTWAIT);
  if (got < 0) return errno == EAGAIN || errno == EINTR;
  if (got == 0) return false;
  request->append(part, static_cast<std::size_t>(got));
  for (std::size_t end; (end = request->find("\r\n\r\n")) != request->npos;) {
    if (!Answer(client, request->substr(0, end))) return false;
    request->erase(0, end + 4);
  }
  return request->size() <= kMostRequest;
}

// False where the connection is to end.
bool FileServer::Answer(int client, const std::string& head) const {
  const std::optional<HttpRequest> request = ParseHead(head);
  const auto refuse = [&](const char* status, const char* why) {
    SendText(client, request.value_or(HttpRequest()), status, "text/plain", why,
             "Connection: close\r\n");
    return false;
  };
  if (!request) return refuse("400 Bad Request", "found no request of HTTP\n");
  if (!IsLocalHost(request->host, port_)) {
    return refuse("403 Forbidden", "expected the host 127.0.0.1 or localhost\n");
  }
  if (request->method != "GET" && request->method != "HEAD") {
    return refuse("405 Method Not Allowed", "expected GET\n");
  }
  const auto page = pages_.find(request->path);
  if (page != pages_.end()) {
    return SendText(client, *request, "200 OK", "text/html; charset=utf-8", page->second);
  }
  const std::optional<std::string> path = PathInFolder(folder_, request->path);
  if (path) return SendFile(client, *request, *path);
  return SendText(client, *request, "404 Not Found", "text/plain", "found no such file\n");
}

}  // namespace slcmap::commands
