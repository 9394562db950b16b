// The main program of a Verilated core under cocotb, with the loop that streams samples through the core.
//
// cocotb's own main program is included as it is; only the model that it makes is remembered. A cocotb test calls the
// loop by ctypes. -DBENCH_TDEST and -DBENCH_TUSER tell which optional signals the streams have, and -DBENCH_WIDE
// that one has more than 64 bits: then nobody calls the loop. -DBENCH_CLOCK_BEFORE names the member of the model in
// which Verilator remembers the clock of the last evaluation, if it has one.

#include <cstdint>

#include "Vtop.h"
#ifdef BENCH_CLOCK_BEFORE
#include "Vtop___024root.h"
#endif
#include "loop.h"

static Vtop *core;

class RememberedTop : public Vtop {
  public:
    explicit RememberedTop(const char *name) : Vtop(name) { core = this; }
};

#define Vtop RememberedTop
#include "verilator.cpp"
#undef Vtop

namespace {

void settle(bool clock) {
    core->aclk = clock;
    core->eval();
}

void tick() {
#ifdef BENCH_CLOCK_BEFORE
    core->rootp->BENCH_CLOCK_BEFORE = 0;  // as if it had fallen: nothing follows that but what follows inputs anyway
#else
    settle(false);
#endif
    settle(true);
}

bool input_ready() { return core->s_axis_tready; }
bool output_valid() { return core->m_axis_tvalid; }
void set_input_valid(bool value) { core->s_axis_tvalid = value; }
void set_output_ready(bool value) { core->m_axis_tready = value; }

void set_input([[maybe_unused]] uint64_t tdest, [[maybe_unused]] uint64_t tdata) {
#ifndef BENCH_WIDE
    core->s_axis_tdata = tdata;
#ifdef BENCH_TDEST
    core->s_axis_tdest = tdest;
#endif
#endif
}

Word output() {
    Word word{0, 0, 0};
#ifndef BENCH_WIDE
    word.tdata = static_cast<uint64_t>(core->m_axis_tdata);
#ifdef BENCH_TDEST
    word.tdest = core->m_axis_tdest;
#endif
#ifdef BENCH_TUSER
    word.tuser = core->m_axis_tuser;
#endif
#endif
    return word;
}

}  // namespace
