#include "haptics/sandbox/scene/mates.hpp"

#include <cmath>
#include <cstdio>

namespace touchstone::sandbox {
namespace {

/// To a micrometer, or to a tenth of one where that says more.
std::string inMm(double meters) {
    char text[40];
    std::snprintf(text, sizeof text, "%.4f", meters * 1000);
    std::string shown = text;
    if (shown.ends_with('0')) shown.pop_back();
    return shown + " mm";
}

std::string quoted(std::span<const MatePart> parts, std::size_t part) { return "\"" + parts[part].name + "\""; }

void sayFit(const MateSeat& seat, std::span<const MatePart> obstacles, MateProposal& made) {
    const MatePair& pair = seat.main;
    const std::string where = quoted(obstacles, pair.obstacle.part), deep = ", " + inMm(seat.engaged) + " deep";
    const std::string shaft = inMm(2 * pair.shaft().radius), hole = inMm(2 * pair.hole().inner);
    if (pair.threads()) {
        made.reasons.push_back(std::string("the tool and ") + where + " have a " +
                               (pair.tool.lead > 0 ? "right" : "left") + "-handed thread of " +
                               inMm(std::abs(pair.tool.lead)) + " per turn" + deep);
        return;
    }
    if (pair.tool.flat) {
        made.reasons.push_back((pair.tool.hollow
                                    ? "sides " + hole + " apart go over those " + shaft + " apart of "
                                    : "sides " + shaft + " apart go between those " + hole + " apart of ") +
                               where + deep);
        return;
    }
    made.reasons.push_back((pair.tool.hollow ? "the hole of " + hole + " goes over the shaft of " + shaft + " of "
                                             : "the shaft of " + shaft + " goes into the hole of " + hole + " of ") +
                           where + deep);
    if (pair.clearance() < -1e-9)
        made.doubts.push_back("the shaft of " + shaft + " is drawn thicker than its hole of " + hole +
                              (made.lead != 0 ? ": draw the thread itself, since the parts overlap there"
                                              : ": it goes in with force alone"));
}

void sayStop(const MateSeat& seat, std::span<const MatePart> obstacles, MateProposal& made) {
    const double left = seat.stop ? seat.travel - seat.stop->travel : 0;
    if (seat.stop && std::abs(left) < kSamePlace) {
        made.reasons.push_back((seat.stop->cone     ? "its cone meets that of "
                                : seat.stop->lowest ? "its end meets a face of "
                                                    : "its shoulder meets a face of ") +
                               quoted(obstacles, seat.stop->part) + " there");
    } else if (!seat.modeled) {
        made.doubts.push_back(
            "no face stops the tool on its way in, so it is put flush with the far end: --goal DEPTH says how deep it "
            "goes");
    }
    if (!seat.modeled) return;
    made.reasons.push_back(
        "the tool is modeled there" +
        (left > kSamePlace ? ", " + inMm(left) + " before a face of " + quoted(obstacles, seat.stop->part) + " stops it"
                           : std::string()));
}

void sayTurn(const MateSeat& seat, MateProposal& made) {
    if (made.lead != 0) return;
    if (made.fold == 0) {
        made.reasons.push_back("what goes in is round, so that any turn about the axis is as good");
        return;
    }
    const std::string turns = made.fold == 1 ? "in one turn" : "in " + std::to_string(made.fold) + " turns";
    if (seat.sides > 0) {
        made.reasons.push_back((seat.sides == 1 ? "1 face along the axis meets its counterpart "
                                                : std::to_string(seat.sides) + " faces along the axis meet theirs ") +
                               turns + " about it");
        return;
    }
    made.reasons.push_back("what goes in looks the same " + turns + " about the axis");
    if (!seat.modeled)
        made.doubts.push_back(
            "no flat face along the axis says how the tool is turned about it, so it keeps its turn: --tool-pose gives "
            "another");
}

}  // namespace

std::optional<MateProposal> proposeMate(std::span<const MatePart> tool, std::span<const MatePart> obstacles,
                                        const MateConstraints& given) {
    const std::optional<MateSeat> seat = findSeat(tool, obstacles, given);
    if (!seat) return {};
    MateProposal made;
    made.modeled = seat->modeled;
    if (!seat->modeled) made.pose = poseOf(*seat);
    made.point = seat->obstacle.point;
    made.out = seat->obstacle.up;
    made.lead = given.lead != 0 ? given.lead : seat->main.threads() ? seat->main.tool.lead : 0;
    if (made.lead == 0) made.fold = seat->fold;  // that of a thread is the number of its starts
    made.clearance = seat->main.clearance();
    sayFit(*seat, obstacles, made);
    sayStop(*seat, obstacles, made);
    sayTurn(*seat, made);
    return made;
}

}  // namespace touchstone::sandbox
