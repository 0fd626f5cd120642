#version 430
// Parallel quadratic programming, many problems at once: one to a workgroup, each thread has every 256th row. The updates
// are those of haptics/qp/pqp.cpp (guarded) and pqp_paper.cpp (paper: equations 16 to 19), in single precision. One dispatch
// makes some of the updates, and the next goes on from there: drivers end a dispatch or a loop that takes long.
layout(local_size_x = 256) in;

const int kThreads = 256;
const int kPerThread = 16;
const int kMaxRows = kThreads * kPerThread;
const float kStart = 0.001, kLargestScale = 1000.0, kRunaway = 1e9;
const int kLimit = 0, kSolved = 1, kNotFinite = 2, kGoesOn = 3;

struct Row {
    float b[6];     // guarded: of unit length in the metric of G; paper: of Q = b b'
    float offset;   // e or d
    float inverse;  // of the length; 0: the row has no direction. The paper's form does not use it
};
// Columns of each problem: the six of b, offset and inverse, one column after the other, so that neighboring threads read
// neighboring numbers.
layout(std430, binding = 0) readonly buffer Columns { float columns[]; };
layout(std430, binding = 1) readonly buffer Problems { ivec2 problems[]; };  // first row, limit; last: end of the rows
layout(std430, binding = 2) buffer Forces { float forces[]; };
struct End {
    int iterations, how;
    float carried;  // guarded: pace of the momentum; paper: F of the last update
};
layout(std430, binding = 3) buffer Ends { End ends[]; };
layout(std430, binding = 4) buffer States { vec2 states[]; };  // of each row: u, and guarded: where it came from

uniform int paper, pause;  // pause: iterations after which a dispatch ends
uniform float tolerance, least;

const int kSums = 14, kResidual = 12, kUphill = 13;
shared float sums[kSums][kThreads];
shared float y[kMaxRows];  // of the paper's form

int lane, begin, size, limit;
End end;  // of the earlier dispatch, or the start

float entry(int i, int k) { return columns[8 * begin + k * size + i]; }

Row rowAt(int i) {
    Row row;
    for (int k = 0; k < 6; ++k) row.b[k] = entry(i, k);
    row.offset = entry(i, 6);
    row.inverse = entry(i, 7);
    return row;
}

/// Adds up the lanes of sums[0..count), of which kResidual is a maximum.
void reduce(int count) {
    int widest = kThreads / 2;
    while (widest >= size) widest /= 2;  // lanes beyond the rows are zero
    for (int stride = widest; stride > 0; stride /= 2) {
        barrier();
        if (lane < stride)
            for (int k = 0; k < count; ++k) {
                float other = sums[k][lane + stride];
                sums[k][lane] = k == kResidual ? max(sums[k][lane], other) : sums[k][lane] + other;
            }
    }
    barrier();
}

void guarded() {
    float u[kPerThread], next[kPerThread], reached[kPerThread];
    float along[6], around[6];
    int count = (size - lane + kThreads - 1) / kThreads;
    float scale = 1.0;
    bool starts = end.iterations == 0;
    for (int k = 0; k < kSums; ++k) sums[k][lane] = 0.0;
    if (starts) {
        float slope = 0.0;
        for (int n = 0; n < count; ++n) {
            Row row = rowAt(lane + n * kThreads);
            u[n] = row.inverse > 0.0 ? kStart / row.inverse : 0.0;
            slope += row.inverse > 0.0 ? u[n] * row.offset : 0.0;
            for (int k = 0; k < 6; ++k) sums[k][lane] += u[n] * row.b[k];
        }
        sums[6][lane] = slope;
        reduce(7);
        float length2 = 0.0;
        for (int k = 0; k < 6; ++k) length2 += sums[k][0] * sums[k][0];
        slope = sums[6][0];
        scale = length2 > 0.0 ? clamp(-slope / length2, 0.0, kLargestScale) : slope < 0.0 ? kLargestScale : 0.0;
        barrier();
        for (int k = 0; k < kSums; ++k) sums[k][lane] = 0.0;
    }
    for (int n = 0; n < count; ++n) {
        Row row = rowAt(lane + n * kThreads);
        vec2 state = states[begin + lane + n * kThreads];
        u[n] = starts ? row.inverse > 0.0 ? max(least, scale * u[n]) : 0.0 : state.x;
        reached[n] = starts ? u[n] : state.y;
        for (int k = 0; k < 6; ++k) {
            sums[k][lane] += u[n] * row.b[k];
            sums[6 + k][lane] += u[n] * abs(row.b[k]);
        }
    }
    reduce(12);

    float pace = end.carried;
    int ended = kLimit, iterations = end.iterations;
    for (;; ++iterations) {
        float size1 = 0.0;
        for (int k = 0; k < 6; ++k) {
            along[k] = sums[k][0];
            around[k] = sums[6 + k][0];
            size1 = max(size1, around[k]);
        }
        if (!(size1 < kRunaway)) {
            ended = size1 < 1e30 ? kLimit : kNotFinite;
            break;
        }
        if (iterations == pause) {
            ended = kGoesOn;
            break;
        }
        float nextPace = (1.0 + sqrt(1.0 + 4.0 * pace * pace)) / 2.0, momentum = (pace - 1.0) / nextPace;
        barrier();
        for (int k = 0; k < kSums; ++k) sums[k][lane] = 0.0;
        for (int n = 0; n < count; ++n) {
            Row row = rowAt(lane + n * kThreads);
            float ahead = 0.0, about = 0.0;
            for (int k = 0; k < 6; ++k) {
                ahead += along[k] * row.b[k];
                about += around[k] * abs(row.b[k]);
            }
            float gap = ahead + row.offset;
            sums[kResidual][lane] = max(sums[kResidual][lane], abs(min(gap, u[n])) * row.inverse);
            float plus = max((about + ahead) / 2.0, u[n]), minus = max((about - ahead) / 2.0, 0.0);
            float lowest = row.inverse > 0.0 ? least : 0.0;
            float divisor = max(row.offset, 0.0) + plus + plus;
            float end = max(divisor > 0.0 ? u[n] * ((max(-row.offset, 0.0) + minus + plus) / divisor) : 0.0, lowest);
            float stride = end - reached[n];
            sums[kUphill][lane] += row.inverse > 0.0 ? gap * stride : 0.0;
            reached[n] = end;
            next[n] = max(end + momentum * stride, lowest);
            for (int k = 0; k < 6; ++k) {
                sums[k][lane] += next[n] * row.b[k];
                sums[6 + k][lane] += next[n] * abs(row.b[k]);
            }
        }
        reduce(kSums);
        float residual = sums[kResidual][0];
        if (residual < tolerance || iterations >= limit) {
            ended = residual < tolerance ? kSolved : kLimit;
            break;
        }
        for (int n = 0; n < count; ++n) u[n] = next[n];
        pace = sums[kUphill][0] > 0.0 ? 1.0 : nextPace;
    }
    for (int n = 0; n < count; ++n) {
        int i = begin + lane + n * kThreads;
        states[i] = vec2(u[n], reached[n]);
        forces[i] = u[n] * entry(i - begin, 7);
    }
    if (lane == 0) ends[gl_WorkGroupID.x] = End(iterations, ended, pace);
}

/// For row i: the sums of the positive and the negative entries of Q, each times y, or times one; and Q_ii.
/// All threads call it together, also with rows beyond the last.
vec3 products(int i, bool timesY) {
    float b[6];
    for (int k = 0; k < 6; ++k) b[k] = i < size ? entry(i, k) : 0.0;
    vec3 result = vec3(0.0);
    for (int tile = 0; tile < size; tile += kThreads) {
        barrier();
        for (int k = 0; k < 6; ++k) sums[k][lane] = tile + lane < size ? entry(tile + lane, k) : 0.0;
        barrier();
        int last = min(kThreads, size - tile);
        for (int j = 0; j < last; j += 4) {  // rows beyond the last are zero
            vec4 q = vec4(0.0);
            for (int k = 0; k < 6; ++k)
                q += b[k] * vec4(sums[k][j], sums[k][j + 1], sums[k][j + 2], sums[k][j + 3]);
            vec4 weight = timesY ? vec4(y[tile + j], y[tile + j + 1], y[tile + j + 2], y[tile + j + 3]) : vec4(1.0);
            result.x += dot(max(q, 0.0), weight);
            result.y += dot(max(-q, 0.0), weight);
            if (i - tile - j >= 0 && i - tile - j < 4) result.z = q[i - tile - j];
        }
    }
    barrier();
    return result;
}

void paperForm() {
    float next[kPerThread], r[kPerThread];
    int count = (size + kThreads - 1) / kThreads;
    for (int n = 0; n < count; ++n) {
        vec3 entries = products(lane + n * kThreads, false);
        int i = lane + n * kThreads;
        r[n] = max(entries.z, entries.y);
        y[i] = i >= size ? 0.0 : end.iterations == 0 ? kStart : states[begin + i].x;
    }
    barrier();
    float before = end.carried;
    int ended = kLimit, iterations = end.iterations;
    for (;; ++iterations) {
        if (iterations == pause) {
            ended = kGoesOn;
            break;
        }
        float F = 0.0;
        for (int n = 0; n < count; ++n) {
            int i = lane + n * kThreads;
            vec3 entries = products(i, true);
            if (i >= size) continue;
            float d = entry(i, 6), held = r[n] * y[i];
            next[n] = y[i] * ((max(d, 0.0) + entries.y + held) / (max(-d, 0.0) + entries.x + held));
            F += y[i] * ((entries.x - entries.y) / 2.0 - d);
        }
        sums[0][lane] = F;
        reduce(1);
        F = sums[0][0];
        barrier();
        if (iterations > 0 && !(abs(F) < 1e30)) ended = kNotFinite;
        if (iterations > 0 && abs(F - before) < tolerance) ended = kSolved;
        if (ended != kLimit || iterations >= limit) break;
        before = F;
        for (int n = 0; n < count; ++n)
            if (lane + n * kThreads < size) y[lane + n * kThreads] = next[n];
        barrier();
    }
    for (int i = lane; i < size; i += kThreads) {
        states[begin + i].x = y[i];
        forces[begin + i] = y[i];
    }
    if (lane == 0) ends[gl_WorkGroupID.x] = End(iterations, ended, before);
}

void main() {
    lane = int(gl_LocalInvocationIndex);
    begin = problems[gl_WorkGroupID.x].x;
    size = problems[gl_WorkGroupID.x + 1].x - begin;
    limit = problems[gl_WorkGroupID.x].y;
    end = ends[gl_WorkGroupID.x];
    if (end.how != kGoesOn) return;
    barrier();  // all have read the end before one writes it
    if (paper != 0)
        paperForm();
    else
        guarded();
}
