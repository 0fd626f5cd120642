#include "haptics/sandbox/app/app_window.hpp"

#include "haptics/sandbox/app/app.hpp"

namespace touchstone::sandbox {

int runWindow(const WindowRunOptions& options) { return App(options).run(); }

}  // namespace touchstone::sandbox
