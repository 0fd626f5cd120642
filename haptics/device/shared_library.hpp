#pragma once
// A vendor's library that is loaded at run time, with all error messages if it cannot be loaded.
#include <span>
#include <string>
#include <vector>

namespace touchstone {

/// The library is never unloaded: the vendors' libraries do not survive being loaded a second time.
class SharedLibrary {
  public:
    /// Loads the first of `names` that can be loaded.
    explicit SharedLibrary(const std::vector<std::string>& names);

    explicit operator bool() const { return handle_ != nullptr; }
    const std::string& name() const { return name_; }
    /// The names that failed, each with the loader's message; empty if the first one was loaded.
    const std::string& errors() const { return errors_; }

    /// Sets `function` to the symbol. If the symbol does not exist, it is null and the name is appended to `missing`.
    template <class F>
    void find(const char* symbol, F*& function, std::string& missing) const {
        function = reinterpret_cast<F*>(address(symbol));
        if (!function) missing += (missing.empty() ? "" : ", ") + std::string(symbol);
    }

  private:
    void* address(const char* symbol) const;

    void* handle_ = nullptr;
    std::string name_, errors_;
};

}  // namespace touchstone
