// Runs a core many times with the same samples and handshakes, each time with one bit of its memories or registers
// turned over, or with two bits of one word, and prints what came out.
//
//   core places                       a line for each memory and register: depth, width, name; then the clocks of a run
//   core runs SAMPLES BEATS FLIPS [full]
//                                     a line for each line of FLIPS, "place element bit other clock later": the other
//                                     bit, if it is not -1, is hit `later` clocks after; clock -1: no flip
//
// A line of SAMPLES is "tdest tdata" in hexadecimal; BEATS of results belong to them. A line of the outcome is the number of beats, whether a word with
// a wrong bit was read, and the first beat that differs from the run without a flip, the first one with the flag
// `fault`, and the first one that differs without it, each -1 if there is none; with `full`, all beats follow.
#include "Vtop.h"
#include "verilated.h"
#include "verilated_sym_props.h"
#include "verilated_syms.h"

#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

namespace {

constexpr int kReset = 4;              // clocks
constexpr uint32_t kFault = 1u << 6;   // bit of tuser

struct Place {
    std::string name;
    void* data;
    uint64_t depth;
    int width;
    bool syndrome;  // not a place but a signal that is not 0 when a word was read that has a wrong bit
};

struct Beat {
    uint64_t dest, data;
    uint32_t user;
    bool operator==(const Beat& other) const { return dest == other.dest && data == other.data && (user & ~kFault) == (other.user & ~kFault); }
};

struct Flip {
    long place, element, bit, other, clock, later;
};

struct Run {
    std::vector<Beat> beats;
    bool noticed;
    long clocks;
};

bool is_syndrome(const char* name) {
    constexpr char kEnd[] = "_syndrome";
    const size_t length = std::strlen(name), end = std::strlen(kEnd);
    return length > end && std::strcmp(name + length - end, kEnd) == 0;
}

std::vector<Place> places_of(VerilatedContext& context) {
    std::vector<Place> found;
    const VerilatedScopeNameMap* scopes = context.scopeNameMap();
    for (const auto& [scope_name, scope] : *scopes) {
        VerilatedVarNameMap* variables = scope->varsp();
        if (!variables) continue;
        for (const auto& [name, variable] : *variables) {
            if (!variable.isPublicRW()) continue;
            const int width = int(variable.entBits());
            const uint64_t depth = variable.udims() ? variable.elements(1) : 1;
            found.push_back({std::string(scope_name) + "." + name, variable.datap(), depth, width, is_syndrome(name)});
        }
    }
    return found;
}

int bytes_of(int width) { return width <= 8 ? 1 : width <= 16 ? 2 : width <= 32 ? 4 : width <= 64 ? 8 : 4 * ((width + 31) / 32); }

void turn(const Place& place, uint64_t element, int bit) {
    auto* bytes = static_cast<uint8_t*>(place.data) + element * bytes_of(place.width);
    bytes[bit / 8] ^= uint8_t(1u << (bit % 8));  // little-endian, as the simulator's words are
}

uint32_t next(uint32_t& state) {  // xorshift, Marsaglia 2003
    state ^= state << 13;
    state ^= state >> 17;
    state ^= state << 5;
    return state;
}

Run run(const std::vector<Beat>& samples, size_t beats, const Flip& flip, long most) {
    VerilatedContext context;
    Vtop core{&context, "TOP"};
    auto clock = [&] {
        core.aclk = 1;
        core.eval();
        core.aclk = 0;
        core.eval();
    };
    core.aclk = core.aresetn = core.s_axis_tvalid = core.m_axis_tready = 0;
    core.eval();
    std::vector<Place> places;
    if (flip.clock >= 0) places = places_of(context);
    std::vector<const uint8_t*> syndromes;
    for (const Place& place : places)
        if (place.syndrome) syndromes.push_back(static_cast<const uint8_t*>(place.data));
    for (int k = 0; k < kReset; ++k) clock();
    core.aresetn = 1;
    Run out{{}, false, 0};
    uint32_t pace = 2463534242u;
    size_t sent = 0;
    bool offered = false;
    for (; out.beats.size() < beats && out.clocks < most; ++out.clocks) {
        if (out.clocks == flip.clock) {
            turn(places[flip.place], flip.element, int(flip.bit));
        }
        if (flip.other >= 0 && out.clocks == flip.clock + flip.later) {
            turn(places[flip.place], flip.element, int(flip.other));
        }
        const uint32_t chance = next(pace);
        if (!offered && sent < samples.size() && (chance & 3)) offered = true;
        core.s_axis_tvalid = offered;
        if (offered) {
            core.s_axis_tdata = samples[sent].data;
#ifdef DEST
            core.s_axis_tdest = samples[sent].dest;
#endif
        }
        core.m_axis_tready = (chance >> 8 & 3) != 0;
        core.eval();
        for (const uint8_t* syndrome : syndromes) out.noticed |= *syndrome != 0;
        if (core.m_axis_tvalid && core.m_axis_tready) {
            uint64_t dest = 0;
#ifdef DEST
            dest = core.m_axis_tdest;
#endif
            out.beats.push_back({dest, uint64_t(core.m_axis_tdata), core.m_axis_tuser});
        }
        if (offered && core.s_axis_tready) {
            ++sent;
            offered = false;
        }
        clock();
    }
    return out;
}

std::vector<Beat> samples_in(const char* path) {
    std::ifstream file(path);
    std::vector<Beat> samples;
    Beat beat{0, 0, 0};
    while (file >> std::hex >> beat.dest >> beat.data) samples.push_back(beat);
    return samples;
}

}  // namespace

int main(int argc, char** argv) {
    const std::string command = argc > 1 ? argv[1] : "";
    if (command == "places") {
        VerilatedContext context;
        Vtop core{&context, "TOP"};
        core.eval();
        for (const Place& place : places_of(context))
            if (!place.syndrome) std::printf("%llu %d %s\n", (unsigned long long)place.depth, place.width, place.name.c_str());
            else std::printf("0 0 %s\n", place.name.c_str());
        return 0;
    }
    if (command != "runs" || argc < 5) return 2;
    const std::vector<Beat> samples = samples_in(argv[2]);
    const size_t beats = std::stoul(argv[3]);
    const Run whole = run(samples, beats, {0, 0, 0, -1, -1, 0}, 1L << 40);
    std::printf("%ld\n", whole.clocks);
    std::ifstream flips(argv[4]);
    Flip flip;
    while (flips >> flip.place >> flip.element >> flip.bit >> flip.other >> flip.clock >> flip.later) {
        const Run out = run(samples, beats, flip, 4 * whole.clocks + 100000);
        long wrong = -1, flagged = -1, silent = -1;
        for (size_t k = 0; k < out.beats.size(); ++k) {
            const bool differs = !(out.beats[k] == whole.beats[k]), fault = out.beats[k].user & kFault;
            if (differs && wrong < 0) wrong = long(k);
            if (fault && flagged < 0) flagged = long(k);
            if (differs && !fault && silent < 0) silent = long(k);
        }
        std::printf("%zu %d %ld %ld %ld", out.beats.size(), int(out.noticed), wrong, flagged, silent);
        if (argc > 5)
            for (const Beat& beat : out.beats)
                std::printf(" %llx:%llx:%x", (unsigned long long)beat.dest, (unsigned long long)beat.data, beat.user);
        std::printf("\n");
        std::fflush(stdout);
    }
    return 0;
}
