// Where the program is, and the files that are installed with it: the page that maps are put into,
// the rigs of the simulator.
#pragma once

#include <string>

namespace slcmap::inline data {

// The file that holds this code: the program's, or that of a shared library which another program
// has loaded, as Python does with its modules. As the system names it; it can be read.
std::string ProgramFile();

// The path of what is installed as share/slcmap/NAME, a file or a folder, in a folder above that of
// the program file: of /usr/bin/slcmap it is /usr/share/slcmap/NAME, of build/bin/slcmap the one in
// build. "" where there is none.
//
//   FindSharedFile("page/page.html")
std::string FindSharedFile(const std::string& name);

// The folder config/ that is installed with the program, or that of the sources.
std::string ConfigFolder();

}  // namespace slcmap::data
