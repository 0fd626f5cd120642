#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <utility>

#include "haptics/sandbox/app/app.hpp"
#include "haptics/sandbox/scene/units.hpp"
#include "haptics/sandbox/session/presets.hpp"

namespace touchstone::sandbox {

/// Draws a line from the held point of the tool to the mouse target. The line gets longer when the tool is blocked.
void App::drawMousePull(const engine::Area& picture) const {
    const TickRecord* record = session_.record();
    if (!grab_.holding() || !record) return;
    const glm::vec2 viewport(picture.size.x, picture.size.y);
    const auto a = camera_.project(glm::vec3(toMeters(record->X_WT * grab_.heldPoint())), viewport);
    const auto b = camera_.project(glm::vec3(toMeters(grab_.anchor())), viewport);
    if (!a || !b) return;
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    const ImVec2 from{picture.position.x + a->x, picture.position.y + a->y},
        to{picture.position.x + b->x, picture.position.y + b->y};
    constexpr ImU32 kColor = IM_COL32(255, 215, 110, 230);
    list.AddLine(from, to, kColor, 2);
    list.AddCircleFilled(from, 4, kColor);
    list.AddCircle(to, 6, kColor, 0, 2);
}

ToolPoses App::toolPoses() const {
    const TickRecord* record = session_.record();
    if (!record) return {};
    return {record->X_WT, session_.device().mouse ? record->X_WT_device : record->X_WT, true};
}

void App::handleMouse(const engine::Area& picture) {
    const ImGuiIO& io = ImGui::GetIO();
    const auto down = [](int key) { return ImGui::IsKeyDown(key); };
    const auto between = [&](int less, int more) { return float(down(more)) - float(down(less)); };
    engine::MouseFrame mouse;
    mouse.cursor = {io.MousePos.x - picture.position.x, io.MousePos.y - picture.position.y};
    mouse.viewport = {picture.size.x, picture.size.y};
    mouse.left = io.MouseDown[0];
    mouse.right = io.MouseDown[1];
    mouse.middle = io.MouseDown[2];
    mouse.turnKey = io.KeyShift;
    mouse.wheel = io.MouseWheel;
    if (!io.WantTextInput) {
        constexpr float kStepsPerSecond = 15, kRadiansPerSecond = 1;
        mouse.depthKeys = kStepsPerSecond * io.DeltaTime * between(GLFW_KEY_PAGE_DOWN, GLFW_KEY_PAGE_UP);
        mouse.turnKeys = kRadiansPerSecond * io.DeltaTime *
                         glm::vec3(between(GLFW_KEY_UP, GLFW_KEY_DOWN), between(GLFW_KEY_LEFT, GLFW_KEY_RIGHT),
                                   between(GLFW_KEY_COMMA, GLFW_KEY_PERIOD));
    }
    const bool inside = ImGui::IsMousePosValid() && mouse.cursor.x >= 0 && mouse.cursor.y >= 0 &&
                        mouse.cursor.x < mouse.viewport.x && mouse.cursor.y < mouse.viewport.y;
    mouse.elsewhere = io.WantCaptureMouse || !inside;

    // A new device starts at the tool's pose, not where the previous one was left.
    if (const LoopSnapshot* loop = session_.snapshot())
        if (std::exchange(grabSession_, loop->session) != loop->session && !grab_.holding()) grab_.reset();
    const TickRecord* record = session_.record();
    const ToolPoses poses = toolPoses();
    GrabTool tool;
    if (record) tool = {.world = viewed_->world.get(), .X_WT = poses.X_WT, .X_WT_device = poses.X_WT_device};
    toolOnScreen_.reset();
    if (record)
        if (const auto at = camera_.project(glm::vec3(toMeters(record->X_WT * tool.world->p_TC())), mouse.viewport))
            toolOnScreen_ = *at + glm::vec2(picture.position.x, picture.position.y);

    std::optional<Pose> wanted;  // target pose of the hand
    if (viewed_ && !grab_.holding()) {
        const Selection::Result result = selection_.update(mouse, camera_, *viewed_, poses, inspector_.ownAxes,
                                                           5.5f * ImGui::GetFontSize(), io.KeyCtrl);
        if (result.edit) requests_.edits = {*result.edit};
        wanted = result.hand;
    }
    if (wanted) grab_.reset();  // the next grab continues from where the handles left the hand
    if (selection_.busy()) mouse.elsewhere = true;
    if (!selection_.dragging() && (ImGui::IsMousePosValid() || !grab_.holding()))
        grab_.update(mouse, camera_, record ? &tool : nullptr);
    if (grab_.holding()) wanted = grab_.wanted();
    if (viewed_ && grab_.clicked()) selection_.click(*viewed_, poses, camera_.ray(mouse.cursor, mouse.viewport));

    if (wanted) {
        everHeld_ = true;
        if (!session_.device().mouse) session_.chooseDevice("mouse");
        if (MouseTarget* target = session_.device().mouse.get()) target->grab(*wanted, hapticsPanel_.strength);
    } else if (session_.device().mouse.get() && (holding_ || strength_ != hapticsPanel_.strength)) {
        session_.device().mouse.get()->release(hapticsPanel_.strength);
        strength_ = hapticsPanel_.strength;
    }
    holding_ = wanted.has_value();
    if (grab_.hovering() || selection_.busy() || holding_) ImGui::SetMouseCursor(ImGuiMouseCursor_Hand);
    const glm::vec2 corner(picture.position.x, picture.position.y);
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    list.PushClipRect(picture.position, {picture.position.x + picture.size.x, picture.position.y + picture.size.y});
    if (viewed_) selection_.draw(list, camera_, corner, mouse.viewport, *viewed_, poses);
    drawMousePull(picture);
    list.PopClipRect();
}

void App::handleKeys() {
    const ImGuiIO& io = ImGui::GetIO();
    const auto pressed = [](int key) { return ImGui::IsKeyPressed(key, false); };
    if (pressed(GLFW_KEY_F1)) menu_.helpDialog = true;
    requests_.fold.left |= pressed(GLFW_KEY_F2);
    requests_.fold.right |= pressed(GLFW_KEY_F3);
    requests_.fold.bottom |= pressed(GLFW_KEY_F4);
    if (io.WantTextInput) return;
    if (io.KeyShift && pressed(GLFW_KEY_SLASH)) menu_.helpDialog = true;
    using engine::StandardView;
    if (pressed(GLFW_KEY_KP_1)) requests_.view = io.KeyCtrl ? StandardView::Back : StandardView::Front;
    if (pressed(GLFW_KEY_KP_3)) requests_.view = io.KeyCtrl ? StandardView::Left : StandardView::Right;
    if (pressed(GLFW_KEY_KP_7)) requests_.view = io.KeyCtrl ? StandardView::Bottom : StandardView::Top;
    if (io.KeyCtrl) {
        if (pressed(GLFW_KEY_O)) menu_.openDialog = true;
        if (pressed(GLFW_KEY_S)) menu_.saveDialog = viewed_ != nullptr;
        if (pressed(GLFW_KEY_Q)) requests_.quit = true;
        if (pressed(GLFW_KEY_Z) && !options_.study) (io.KeyShift ? requests_.redo : requests_.undo) = true;
        if (pressed(GLFW_KEY_Y) && !options_.study) requests_.redo = true;
        if (io.KeyShift && pressed(GLFW_KEY_C)) requests_.copyCommand = true;
        return;
    }
    // In a list, a menu or a dialog, Escape only closes that.
    if (pressed(GLFW_KEY_ESCAPE) && !engine::closeList() && viewed_ &&
        !ImGui::IsPopupOpen("", ImGuiPopupFlags_AnyPopup))
        selection_.dragging() ? selection_.cancel(*viewed_) : selection_.select({});
    if (pressed(GLFW_KEY_R)) requests_.restart = true;
    if (pressed(GLFW_KEY_F)) (selection_.node() ? requests_.frameSelection : requests_.frameCamera) = true;
    if (pressed(GLFW_KEY_A) || pressed(GLFW_KEY_HOME)) requests_.frameCamera = true;
    if (pressed(GLFW_KEY_E)) inspector_.ownAxes = !inspector_.ownAxes;
    if (pressed(GLFW_KEY_H)) menu_.panels = !menu_.panels;
    if (pressed(GLFW_KEY_S) && !options_.study) session_.setSettings(withSolversSwapped(session_.settings()));
    for (const DisplaySwitch& which : displaySwitches())
        if (pressed(which.key)) turn(display_, which, !isOn(display_, which));  // GLFW's keys are capital letters
    if (pressed(GLFW_KEY_SPACE)) requests_.stopOrEngage = true;
}

}  // namespace touchstone::sandbox
