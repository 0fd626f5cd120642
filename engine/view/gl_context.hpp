#pragma once
// An OpenGL context without a display, for rendered pictures and tests.
#include <memory>
#include <string>

#include "engine/scene/mesh_data.hpp"

namespace touchstone::engine {

/// An OpenGL core context without window or display, through EGL: 4.3 where a driver has it, else 3.3, of a graphics
/// card before Mesa's rasterizer. It is current on the constructing thread until it is destroyed or another context is
/// made current. It has no default framebuffer: draw with renderToImage() or into a framebuffer object. Throws
/// std::runtime_error with one sentence that names the remedy if no driver offers such a context.
class HeadlessContext {
  public:
    HeadlessContext();
    ~HeadlessContext();
    HeadlessContext(const HeadlessContext&) = delete;
    HeadlessContext& operator=(const HeadlessContext&) = delete;

    /// Makes this context current on the calling thread.
    void makeCurrent();

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// Detaches the current context of the calling thread, a window's or a headless one. This is needed before a switch
/// between EGL and GLX: otherwise the second context is refused, or the X server ends the process.
void releaseCurrentContext();

/// Version and renderer of the current context, e.g. "OpenGL 4.5, llvmpipe (LLVM 15.0.6)".
std::string glDescription();
/// Whether the current context draws on the processor, as Mesa's llvmpipe does, and not on a graphics card.
bool drawsInSoftware();

/// Reads width x height pixels, lower-left corner at the origin, from the read buffer of the bound read framebuffer
/// and turns them top row first. Alpha is set to 255.
Image readPixels(int width, int height);

}  // namespace touchstone::engine
