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
        const char* told = dlerror();
        const std::string words = told ? told : "no reason given";
        // The loader names most files itself.
        trouble_ += (trouble_.empty() ? "" : "; ") + (words.rfind(name + ":", 0) == 0 ? "" : name + ": ") + words;
    }
}

void* SharedLibrary::address(const char* symbol) const { return handle_ ? dlsym(handle_, symbol) : nullptr; }

}  // namespace touchstone
