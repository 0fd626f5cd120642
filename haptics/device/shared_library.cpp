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
        const char* reason = dlerror();
        const std::string message = reason ? reason : "no reason given";
        // Most messages of the loader begin with the name of the file.
        errors_ += (errors_.empty() ? "" : "; ") + (message.rfind(name + ":", 0) == 0 ? "" : name + ": ") + message;
    }
}

void* SharedLibrary::address(const char* symbol) const { return handle_ ? dlsym(handle_, symbol) : nullptr; }

}  // namespace touchstone
