// The loop that streams samples through a simulated core, compiled together with the core's model.
//
// The file that includes this one defines the functions declared first, which are all that the loop knows of the model.
//
// sosmith_stream is called by ctypes while the clock is low and every input has settled, and leaves the core so.
// Simulated time stands still meanwhile. One clock here is one clock of `StreamBench.stream` in bench.py, rule by rule
// and draw by draw: tests hold both together.

#include <cstdint>

namespace {

struct Word {
    uint64_t tdest, tdata, tuser;
    bool operator!=(const Word &other) const {
        return tdest != other.tdest || tdata != other.tdata || tuser != other.tuser;
    }
};

void settle(bool clock);  // set the clock, and let everything follow
void tick();              // the same for a clock that falls and rises, where nobody looks in between
bool input_ready();       // s_axis_tready
bool output_valid();      // m_axis_tvalid
Word output();            // m_axis_tdest, m_axis_tdata, m_axis_tuser; 0 for what the core lacks
void set_input_valid(bool value);
void set_output_ready(bool value);
void set_input(uint64_t tdest, uint64_t tdata);

enum Outcome : int32_t { GOES_ON, DONE, FOLLOWED, MOVED, HUNG, TOO_MANY };

struct Pace {
    double waiting, spread, share;
    uint64_t left;
};

// State of the loop between its blocks; compiled_loop.py has the same structure.
struct Stream {
    // What is sent, and room for what is received.
    const int64_t *sent_tdest;
    const uint64_t *sent_tdata;
    uint64_t to_send, to_receive;
    int64_t *received_tdest;
    uint64_t *received_tdata;
    uint64_t *received_tuser;
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

void offer(const Stream &s) {
    set_input_valid(s.offered != 0);
    if (s.offered) set_input(s.sent_tdest[s.sent], s.sent_tdata[s.sent]);
}

// Whether any output follows s_axis_tvalid or m_axis_tready while the clock is low. They are left as they are given.
bool outputs_follow(bool offered, bool accepting) {
    const bool ready = input_ready(), valid = output_valid();
    const Word word = output();
    for (int inputs = 0; inputs < 4; ++inputs) {
        set_input_valid(inputs >> 1);
        set_output_ready(inputs & 1);
        settle(false);
        if (input_ready() != ready || output_valid() != valid || output() != word) return true;
    }
    set_input_valid(offered);
    set_output_ready(accepting);
    settle(false);
    return false;
}

// Clock until the core accepts or offers something, for at most `limit` clocks; return how many. The sleeping bench is
// woken by an edge, and counts up to the next falling edge of the clock.
uint64_t sleep_while_busy(uint64_t limit) {
    settle(false);
    uint64_t clocks = 1;
    for (;; ++clocks) {
        const bool woken = input_ready() || output_valid();
        tick();
        if (woken || clocks == limit || input_ready() || output_valid()) return clocks;
    }
}

}  // namespace

// Go on with the stream for about `clocks` clocks.
extern "C" int32_t sosmith_stream(Stream *stream, uint64_t clocks) {
    Stream &s = *stream;
    const uint64_t stop = s.clocks + clocks;
    Outcome outcome = DONE;
    while (s.sent < s.to_send || s.received < s.to_receive) {
        if (s.clocks >= stop) {
            outcome = GOES_ON;
            break;
        }
        // Outputs are read before the inputs of this clock reach the core, except where these are probed.
        if (!s.offered) s.offered = s.sent < s.to_send && goes(s.idle, s);
        const bool ready = goes(s.stall, s), probed = uniform(s) < s.probed_share;
        if (probed) {
            offer(s);
            set_output_ready(ready);
            settle(false);
            if (outputs_follow(s.offered, ready)) {
                outcome = FOLLOWED;
                break;
            }
        }
        const bool valid = output_valid(), accepted = s.offered && input_ready();
        const Word word = output();
        if (s.held_valid && (!valid || word != s.held)) {
            s.word = word;
            s.word_valid = valid;
            outcome = MOVED;
            break;
        }
        offer(s);
        set_output_ready(ready);
        s.held_valid = valid && !ready;
        s.held = word;
        if (valid && ready) {
            if (s.received == s.to_receive) {
                outcome = TOO_MANY;
                break;
            }
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
            tick();
            ++s.clocks;
        }
    }
    settle(false);
    return outcome;
}
