// The files of a folder over HTTP, for a browser on the same computer.
#pragma once

#include <functional>
#include <map>
#include <string>

namespace slcmap::inline commands {

// Takes connections of this computer only (127.0.0.1), and of these only requests that name it as
// their host, so that pages of others cannot have a browser read the files. Answers GET and HEAD,
// with ranges. Paths stay within the folder, also through symbolic links. One thread; a client that
// is slow keeps nobody waiting but while it takes a part of an answer.
class FileServer {
 public:
  // `pages` are answered at their paths, such as "/", before files are; as HTML. Port 0 takes any
  // that is free. Throws DataError where the folder cannot be read, and ConfigError where the port
  // is in use or may not be had.
  FileServer(const std::string& folder, int port, std::map<std::string, std::string> pages);
  ~FileServer();
  FileServer(const FileServer&) = delete;
  FileServer& operator=(const FileServer&) = delete;

  int port() const { return port_; }

  // Serves until stop() says so, which is asked every tenth of a second or more often.
  void Run(const std::function<bool()>& stop);

 private:
  // A connection, and what of its next request has come.
  using Clients = std::map<int, std::string>;

  void Accept(Clients* clients) const;
  bool Read(int client, std::string* request) const;
  bool Answer(int client, const std::string& request) const;

  std::string folder_;
  std::map<std::string, std::string> pages_;
  int listener_ = -1, port_ = 0;
};

}  // namespace slcmap::commands
