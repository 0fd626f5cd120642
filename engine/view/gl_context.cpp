#include "engine/view/gl_context.hpp"

#include <epoxy/egl.h>
#include <epoxy/gl.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

namespace touchstone::engine {
namespace {

bool hasClientExtension(std::string_view name) {
    const char* list = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    return list && std::string_view(list).find(name) != std::string_view::npos;
}

/// Whether Mesa's rasterizer is the device.
bool isSoftware(EGLDeviceEXT device) {
    const char* list =
        hasClientExtension("EGL_EXT_device_query") ? eglQueryDeviceStringEXT(device, EGL_EXTENSIONS) : "";
    return list && std::string_view(list).find("EGL_MESA_device_software") != std::string_view::npos;
}

/// Displays that need no screen, best first: each graphics card, Mesa's surfaceless platform, the driver's default.
/// Where two vendors' drivers are installed, the surfaceless platform is Mesa's, which may know no card.
std::vector<EGLDisplay> screenlessDisplays() {
    std::vector<EGLDisplay> displays;
    if (hasClientExtension("EGL_EXT_platform_base")) {
        if (hasClientExtension("EGL_EXT_platform_device") && hasClientExtension("EGL_EXT_device_enumeration")) {
            std::array<EGLDeviceEXT, 16> devices{};
            EGLint count = 0;
            if (eglQueryDevicesEXT(static_cast<EGLint>(devices.size()), devices.data(), &count))
                for (EGLint i = 0; i < count; ++i)
                    if (!isSoftware(devices[i]))
                        displays.push_back(eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, devices[i], nullptr));
        }
        if (hasClientExtension("EGL_MESA_platform_surfaceless"))
            displays.push_back(eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr));
    }
    displays.push_back(eglGetDisplay(EGL_DEFAULT_DISPLAY));
    std::erase(displays, EGL_NO_DISPLAY);
    return displays;
}

/// A context of the newest version that this program uses and the driver has: some drivers give only what is asked.
EGLContext createContext(EGLDisplay display) {
    // Do not request a surface type: no surface will be created, and some platforms offer none.
    const std::array<EGLint, 5> want{EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_SURFACE_TYPE, EGL_DONT_CARE, EGL_NONE};
    EGLConfig config = nullptr;
    EGLint count = 0;
    if (!eglBindAPI(EGL_OPENGL_API) || !eglChooseConfig(display, want.data(), &config, 1, &count) || count < 1)
        return EGL_NO_CONTEXT;
    for (const auto& [major, minor] : {std::pair{4, 3}, std::pair{3, 3}}) {
        const std::array<EGLint, 7> attributes{EGL_CONTEXT_MAJOR_VERSION,
                                               major,
                                               EGL_CONTEXT_MINOR_VERSION,
                                               minor,
                                               EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                               EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                               EGL_NONE};
        if (const EGLContext context = eglCreateContext(display, config, EGL_NO_CONTEXT, attributes.data());
            context != EGL_NO_CONTEXT)
            return context;
    }
    return EGL_NO_CONTEXT;
}

}  // namespace

struct HeadlessContext::Impl {
    EGLDisplay display = EGL_NO_DISPLAY;
    EGLContext context = EGL_NO_CONTEXT;

    bool open(EGLDisplay candidate) {
        if (!eglInitialize(candidate, nullptr, nullptr)) return false;
        display = candidate;
        context = createContext(display);
        releaseCurrentContext();
        if (context != EGL_NO_CONTEXT && eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) return true;
        close();
        return false;
    }

    void close() {
        if (context != EGL_NO_CONTEXT) {
            if (eglGetCurrentContext() == context) releaseCurrentContext();
            eglDestroyContext(display, context);
            context = EGL_NO_CONTEXT;
        }
        // The display is shared by the whole process, so it stays initialized.
        display = EGL_NO_DISPLAY;
    }
};

HeadlessContext::HeadlessContext() : impl_(std::make_unique<Impl>()) {
    for (EGLDisplay display : screenlessDisplays())
        if (impl_->open(display)) return;
    throw std::runtime_error(
        "No OpenGL 3.3 driver can draw without a display; install Mesa's software driver (Debian: apt-get install "
        "libegl1 libegl-mesa0 libgl1-mesa-dri).");
}

HeadlessContext::~HeadlessContext() { impl_->close(); }

void HeadlessContext::makeCurrent() {
    releaseCurrentContext();
    if (!eglMakeCurrent(impl_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, impl_->context))
        throw std::runtime_error("The OpenGL context cannot be made current: another thread uses it.");
}

void releaseCurrentContext() {
    if (glfwGetCurrentContext()) glfwMakeContextCurrent(nullptr);
    if (eglGetCurrentContext() != EGL_NO_CONTEXT)
        eglMakeCurrent(eglGetCurrentDisplay(), EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
}

std::string glDescription() {
    const auto text = [](GLenum name) {
        const auto* value = reinterpret_cast<const char*>(glGetString(name));
        return std::string(value ? value : "?");
    };
    const int version = epoxy_gl_version();
    return "OpenGL " + std::to_string(version / 10) + "." + std::to_string(version % 10) + ", " + text(GL_RENDERER);
}

bool drawsInSoftware() {
    const std::string renderer = glDescription();
    constexpr std::array kSoftware{"llvmpipe", "softpipe", "swrast", "SwiftShader", "Software Rasterizer"};
    return std::any_of(kSoftware.begin(), kSoftware.end(),
                       [&](const char* name) { return renderer.find(name) != std::string::npos; });
}

Image readPixels(int width, int height) {
    Image image{width, height, std::vector<std::uint8_t>(4 * static_cast<std::size_t>(width) * height)};
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, image.rgba.data());
    const std::size_t row = 4 * static_cast<std::size_t>(width);
    for (int top = 0, bottom = height - 1; top < bottom; ++top, --bottom)
        std::swap_ranges(image.rgba.begin() + top * row, image.rgba.begin() + (top + 1) * row,
                         image.rgba.begin() + bottom * row);
    for (std::size_t i = 3; i < image.rgba.size(); i += 4) image.rgba[i] = 255;
    return image;
}

}  // namespace touchstone::engine
