#pragma once
// What both programs need of DDS: participant, topics, quality of service.
#include <dds/dds.h>

#include <cstdint>
#include <ctime>
#include <stdexcept>
#include <string>

#include "ros_types.h"

using PoseStamped = geometry_msgs_msg_dds__PoseStamped_;
using WrenchStamped = geometry_msgs_msg_dds__WrenchStamped_;

inline dds_entity_t checked(dds_entity_t entity, const char* what) {
    if (entity < 0) throw std::runtime_error(std::string(what) + ": " + dds_strretcode(-entity));
    return entity;
}

/// A domain's participant with one topic in and one out. Only the newest sample matters. The writer is reliable,
/// because a reliable reader, ROS 2's default, accepts no other; the reader accepts every writer.
class Node {
  public:
    Node(std::uint32_t domain, const dds_topic_descriptor_t* in, const std::string& inName,
         const dds_topic_descriptor_t* out, const std::string& outName)
        : participant_(checked(dds_create_participant(domain, nullptr, nullptr), "DDS participant")) {
        dds_qos_t* qos = dds_create_qos();
        dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 1);
        dds_qset_durability(qos, DDS_DURABILITY_VOLATILE);
        dds_qset_reliability(qos, DDS_RELIABILITY_BEST_EFFORT, 0);
        reader_ = checked(dds_create_reader(participant_, topic(in, inName), qos, nullptr), inName.c_str());
        dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_MSECS(1));
        writer_ = checked(dds_create_writer(participant_, topic(out, outName), qos, nullptr), outName.c_str());
        dds_delete_qos(qos);
    }
    ~Node() { dds_delete(participant_); }
    Node(const Node&) = delete;
    Node& operator=(const Node&) = delete;

    /// Calls `use` for each sample that has arrived.
    template <class Message, class Use>
    void take(const Use& use) {
        void* samples[8]{};
        dds_sample_info_t infos[8];
        int count;
        while ((count = dds_take(reader_, samples, infos, 8, 8)) > 0) {
            for (int i = 0; i < count; ++i)
                if (infos[i].valid_data) use(*static_cast<const Message*>(samples[i]));
            dds_return_loan(reader_, samples, count);
        }
    }
    template <class Message>
    void write(const Message& message) {
        dds_write(writer_, &message);
    }

  private:
    dds_entity_t topic(const dds_topic_descriptor_t* type, const std::string& name) {
        return checked(dds_create_topic(participant_, type, name.c_str(), nullptr, nullptr), name.c_str());
    }

    const dds_entity_t participant_;
    dds_entity_t reader_, writer_;
};

inline std::int64_t nanoseconds(const builtin_interfaces_msg_dds__Time_& time) {
    return std::int64_t{time.sec} * 1'000'000'000 + time.nanosec;
}
inline builtin_interfaces_msg_dds__Time_ now() {
    timespec t{};
    clock_gettime(CLOCK_REALTIME, &t);
    return {static_cast<std::int32_t>(t.tv_sec), static_cast<std::uint32_t>(t.tv_nsec)};
}
inline void pause(long microseconds) {
    const timespec t{0, 1000 * microseconds};
    nanosleep(&t, nullptr);
}
