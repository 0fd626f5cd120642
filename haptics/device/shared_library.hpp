#pragma once
// A vendor's library, loaded when it is asked for and told about in full when it is not there.
#include <span>
#include <string>
#include <vector>

namespace touchstone {

/// Stays loaded for good: the libraries that this is for do not survive being loaded a second time.
class SharedLibrary {
  public:
    /// The first of `names` that can be loaded.
    explicit SharedLibrary(const std::vector<std::string>& names);

    explicit operator bool() const { return handle_ != nullptr; }
    const std::string& name() const { return name_; }
    /// The names tried, each with the loader's own words; empty when the first was loaded.
    const std::string& trouble() const { return trouble_; }

    /// Sets `function` to the symbol; where there is none it is null, and the symbol's name is added to `missing`.
    template <class F>
    void find(const char* symbol, F*& function, std::string& missing) const {
        function = reinterpret_cast<F*>(address(symbol));
        if (!function) missing += (missing.empty() ? "" : ", ") + std::string(symbol);
    }

  private:
    void* address(const char* symbol) const;

    void* handle_ = nullptr;
    std::string name_, trouble_;
};

}  // namespace touchstone
