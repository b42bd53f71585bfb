// The files of a folder over HTTP, for a browser on the same computer.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>

namespace httplib {
class Server;
}

namespace slcmap::inline commands {

// Takes connections of this computer only (127.0.0.1), and of these only requests that name it as
// their host, so that pages of others cannot have a browser read the files. Answers GET and HEAD,
// with ranges. Paths stay within the folder, also through symbolic links.
class FileServer {
 public:
  // `pages` are answered at their paths, such as "/", before files are; as HTML. Port 0 takes any
  // that is free. Throws DataError where the folder cannot be read, and ConfigError where the port
  // is in use or may not be had.
  FileServer(const std::string& folder, int port, std::map<std::string, std::string> pages);
  ~FileServer();

  int port() const { return port_; }

  // Serves until stop() says so, which is asked every tenth of a second.
  void Run(const std::function<bool()>& stop);

 private:
  std::string folder_;
  std::map<std::string, std::string> pages_;
  std::unique_ptr<httplib::Server> server_;
  int port_ = 0;
};

}  // namespace slcmap::commands
