// A core as CXXRTL's model, with the loop that streams samples through it, as a library that Python loads.
//
// model.cc is what Yosys has written of the core, whose top module it calls "core" there. -DBENCH_TDEST and
// -DBENCH_TUSER tell which optional signals the streams have, and -DBENCH_WIDE
// that one has more than 64 bits: then nobody calls the loop.

#include <cstdint>
#include <fstream>
#include <string>

#include "loop.h"
#include "model.cc"

#include <cxxrtl/cxxrtl_vcd.h>

namespace {

cxxrtl_design::p_core core;

const debug_items &items() {
    static debug_items all;
    if (all.table.empty()) core.debug_info(&all, nullptr, "core ");
    return all;
}

const debug_item &item(const char *port) { return items()[std::string("core ") + port]; }

void settle(bool clock) {
    core.p_aclk.set(clock);
    core.step();
    if (clock) core.step();  // what depends on registers follows them
}

void tick() {
    settle(false);
    settle(true);
}

bool input_ready() { return core.p_s__axis__tready.get<bool>(); }
bool output_valid() { return core.p_m__axis__tvalid.get<bool>(); }
void set_input_valid(bool value) { core.p_s__axis__tvalid.set(value); }
void set_output_ready(bool value) { core.p_m__axis__tready.set(value); }

void set_input([[maybe_unused]] uint64_t tdest, [[maybe_unused]] uint64_t tdata) {
#ifndef BENCH_WIDE
    core.p_s__axis__tdata.set(tdata);
#ifdef BENCH_TDEST
    core.p_s__axis__tdest.set(tdest);
#endif
#endif
}

Word output() {
    Word word{0, 0, 0};
#ifndef BENCH_WIDE
    word.tdata = core.p_m__axis__tdata.get<uint64_t>();
#ifdef BENCH_TDEST
    word.tdest = core.p_m__axis__tdest.get<uint64_t>();
#endif
#ifdef BENCH_TUSER
    word.tuser = core.p_m__axis__tuser.get<uint64_t>();
#endif
#endif
    return word;
}

// A waveform, written while the core runs.
struct Waves {
    std::ofstream file;
    vcd_writer writer;
    explicit Waves(const char *path) : file(path) {
        writer.timescale(1, "ns");
        writer.add_without_memories(items());
    }
    void sample(uint64_t time) {
        writer.sample(time);
        file << writer.buffer;
        file.flush();
        writer.buffer.clear();
    }
};

Waves *waves;

}  // namespace

// Bits of a port.
extern "C" uint64_t sosmith_width(const char *port) { return item(port).width; }

// 64 bits of a port, from bit 64 * word on.
extern "C" uint64_t sosmith_read(const char *port, uint64_t word) {
    const debug_item &found = item(port);
    const uint32_t *bits = found.curr + 2 * word;
    return bits[0] | (found.width > 64 * word + 32 ? uint64_t{bits[1]} << 32 : 0);
}

// Set 64 bits of an input, from bit 64 * word on.
extern "C" void sosmith_write(const char *port, uint64_t word, uint64_t value) {
    const debug_item &found = item(port);
    uint32_t *bits = found.curr + 2 * word;
    bits[0] = static_cast<uint32_t>(value);
    if (found.width > 64 * word + 32) bits[1] = static_cast<uint32_t>(value >> 32);
}

// Write a waveform from now on, in a file that this makes.
extern "C" void sosmith_open_waves(const char *path) { waves = new Waves(path); }

// Set the clock at a time in nanoseconds, later than all before, and let everything follow.
extern "C" void sosmith_settle(bool clock, uint64_t time) {
    settle(clock);
    if (waves) waves->sample(time);
}
