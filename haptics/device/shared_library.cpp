#include "haptics/device/shared_library.hpp"

#include <dlfcn.h>

namespace touchstone {

SharedLibrary::SharedLibrary(const std::vector<std::string>& names) {
    for (const std::string& name : names) {
        handle_ = dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL);
        if (handle_) {
            name_ = name;
            return;
        }
        const char* words = dlerror();
        trouble_ += (trouble_.empty() ? "" : "; ") + name + ": " + (words ? words : "no reason given");
    }
}

void* SharedLibrary::address(const char* symbol) const { return handle_ ? dlsym(handle_, symbol) : nullptr; }

}  // namespace touchstone
