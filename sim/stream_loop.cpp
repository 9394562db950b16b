// The main program of a Verilated core under cocotb, and the loop that streams samples through the core.
//
// cocotb's own main program is included as it is; only the model that it makes is remembered. A cocotb test calls
// sosmith_stream by ctypes while the clock is low and every input has settled: the loop drives the same model, and
// leaves it as cocotb's clock would, low and settled. Simulated time stands still meanwhile.
//
// One clock here is one clock of `StreamBench.stream` in stream_bench.py, rule by rule and draw by draw: tests hold both
// together. -DBENCH_TDEST and -DBENCH_TUSER tell which optional signals the streams have.

#include <cstdint>

#include "Vtop.h"

static Vtop *core;

class RememberedTop : public Vtop {
  public:
    explicit RememberedTop(const char *name) : Vtop(name) { core = this; }
};

#define Vtop RememberedTop
#include "verilator.cpp"
#undef Vtop

namespace {

enum Outcome : int32_t { GOES_ON, DONE, FOLLOWED, MOVED, HUNG };

struct Pace {
    double waiting, spread, share;
    uint64_t left;
};

struct Word {
    uint64_t tdest, tdata, tuser;
    bool operator!=(const Word &other) const {
        return tdest != other.tdest || tdata != other.tdata || tuser != other.tuser;
    }
};

// State of the loop between its blocks; compiled_loop.py has the same structure.
struct Stream {
    // What is sent, and room for what is received.
    const int64_t *sent_tdest;
    const uint64_t *sent_tdata;
    uint64_t to_send;
    int64_t *received_tdest;
    uint64_t *received_tdata;
    uint8_t *received_tuser;
    // Settings.
    uint64_t patience, silence_limit, busy;
    double probed_share;
    Pace idle, stall;
    // Progress.
    uint64_t clocks, sent, received, silence;
    uint64_t offered, held_valid, word_valid;
    Word held, word;
    // The Mersenne Twister, as `random.Random.getstate` tells of it.
    uint32_t twister[624];
    uint32_t position;
};

void renew(uint32_t *words) {
    const auto mixed = [words](int i, int next, int far) {
        const uint32_t bits = (words[i] & 0x80000000u) | (words[next] & 0x7fffffffu);
        words[i] = words[far] ^ (bits >> 1) ^ (bits & 1 ? 0x9908b0dfu : 0u);
    };
    for (int i = 0; i < 227; ++i) mixed(i, i + 1, i + 397);
    for (int i = 227; i < 623; ++i) mixed(i, i + 1, i - 227);
    mixed(623, 0, 396);
}

uint32_t next_bits(Stream &s) {
    if (s.position == 624) {
        renew(s.twister);
        s.position = 0;
    }
    uint32_t bits = s.twister[s.position++];
    bits ^= bits >> 11;
    bits ^= (bits << 7) & 0x9d2c5680u;
    bits ^= (bits << 15) & 0xefc60000u;
    return bits ^ (bits >> 18);
}

double uniform(Stream &s) {
    const uint32_t high = next_bits(s) >> 5, low = next_bits(s) >> 6;
    return (high * 67108864.0 + low) / 9007199254740992.0;
}

uint32_t below(uint32_t limit, int bits, Stream &s) {
    uint32_t drawn;
    do {
        drawn = next_bits(s) >> (32 - bits);
    } while (drawn >= limit);
    return drawn;
}

bool goes(Pace &pace, Stream &s) {
    if (pace.left == 0) {
        pace.left = 20 + below(180, 8, s);
        const uint32_t kind = below(3, 2, s);
        pace.share = pace.waiting + (kind == 0 ? -pace.spread : kind == 1 ? 0.0 : pace.spread);
    }
    --pace.left;
    return uniform(s) >= pace.share;
}

void settle(bool clock) {
    core->aclk = clock;
    core->eval();
}

Word output() {
    Word word{0, static_cast<uint64_t>(core->m_axis_tdata), 0};
#ifdef BENCH_TDEST
    word.tdest = core->m_axis_tdest;
#endif
#ifdef BENCH_TUSER
    word.tuser = core->m_axis_tuser;
#endif
    return word;
}

void offer(const Stream &s) {
    core->s_axis_tvalid = s.offered != 0;
    if (s.offered) {
        core->s_axis_tdata = s.sent_tdata[s.sent];
#ifdef BENCH_TDEST
        core->s_axis_tdest = s.sent_tdest[s.sent];
#endif
    }
}

// Whether any output follows s_axis_tvalid or m_axis_tready while the clock is low.
bool outputs_follow() {
    const auto valid_held = core->s_axis_tvalid, ready_held = core->m_axis_tready;
    const auto ready = core->s_axis_tready, valid = core->m_axis_tvalid;
    const Word word = output();
    for (int inputs = 0; inputs < 4; ++inputs) {
        core->s_axis_tvalid = inputs >> 1;
        core->m_axis_tready = inputs & 1;
        core->eval();
        if (core->s_axis_tready != ready || core->m_axis_tvalid != valid || output() != word) return true;
    }
    core->s_axis_tvalid = valid_held;
    core->m_axis_tready = ready_held;
    core->eval();
    return false;
}

// Clock until the core accepts or offers something, for at most `limit` clocks; return how many. The sleeping bench is
// woken by an edge, and counts up to the next falling edge of the clock.
uint64_t sleep_while_busy(uint64_t limit) {
    settle(false);
    uint64_t clocks = 1;
    for (;; ++clocks) {
        const bool woken = core->s_axis_tready || core->m_axis_tvalid;
        settle(true);
        if (woken || clocks == limit || core->s_axis_tready || core->m_axis_tvalid) return clocks;
        settle(false);
    }
}

}  // namespace

// Go on with the stream for about `clocks` clocks.
extern "C" int32_t sosmith_stream(Stream *stream, uint64_t clocks) {
    Stream &s = *stream;
    const uint64_t stop = s.clocks + clocks;
    Outcome outcome = DONE;
    while (s.received < s.to_send) {
        if (s.clocks >= stop) {
            outcome = GOES_ON;
            break;
        }
        // Outputs are read before the inputs of this clock reach the core, except where these are probed.
        if (!s.offered) s.offered = s.sent < s.to_send && goes(s.idle, s);
        const bool ready = goes(s.stall, s), probed = uniform(s) < s.probed_share;
        if (probed) {
            offer(s);
            core->m_axis_tready = ready;
            settle(false);
            if (outputs_follow()) {
                outcome = FOLLOWED;
                break;
            }
        }
        const bool valid = core->m_axis_tvalid, accepted = s.offered && core->s_axis_tready;
        const Word word = output();
        if (s.held_valid && (!valid || word != s.held)) {
            s.word = word;
            s.word_valid = valid;
            outcome = MOVED;
            break;
        }
        offer(s);
        core->m_axis_tready = ready;
        s.held_valid = valid && !ready;
        s.held = word;
        if (valid && ready) {
            s.received_tdest[s.received] = word.tdest;
            s.received_tdata[s.received] = word.tdata;
            s.received_tuser[s.received] = word.tuser;
            ++s.received;
        }
        const bool waits = s.offered && !accepted && !valid && s.patience > s.busy;
        if (accepted) {
            ++s.sent;
            s.offered = false;
        }
        s.silence = accepted || (valid && ready) ? 0 : s.silence + 1;
        if (s.silence > s.silence_limit + s.patience) {
            outcome = HUNG;
            break;
        }
        if (waits) {
            // The limit is a timer: set at a falling edge of the clock it is as early as one, else later.
            const bool on_the_edge = !probed && s.clocks != 0;
            const uint64_t slept = sleep_while_busy(on_the_edge ? s.patience : s.patience + 1);
            s.clocks += slept;
            s.silence += slept - 1;
        } else {
            settle(false);
            settle(true);
            ++s.clocks;
        }
    }
    settle(false);
    return outcome;
}
