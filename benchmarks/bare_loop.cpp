// A core in a bare loop, to measure the bench of sosmith.sim against: no cocotb, no Python, no VPI, no recording.
//
//   bare_loop WORDS SAMPLES PATIENCE SEED
//
// Sends the 64-bit words of the file WORDS with 30 % of the clocks idle and 30 % stalled, in bursts, and checks what
// the bench checks: a stalled word stays, samples keep moving, and no output follows an input within a clock, which is
// tried at one clock in 32. While the core is busy with a sample, nothing is drawn. Prints the clocks, and the seconds of processor time.

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <random>
#include <vector>

#include "Vtop.h"
#include "verilated.h"

static std::mt19937 source;

static double uniform() {
    const uint32_t high = source() >> 5, low = source() >> 6;
    return (high * 67108864.0 + low) / 9007199254740992.0;
}

struct Pace {
    double waiting, share = 0;
    int left = 0;
    bool goes() {
        if (left-- == 0) {
            left = 19 + int(180 * uniform());
            share = waiting + (int(3 * uniform()) - 1) * waiting;
        }
        return uniform() >= share;
    }
};

static void check(bool holds, const char *rule) {
    if (holds) return;
    std::fprintf(stderr, "%s\n", rule);
    std::exit(1);
}

int main(int, char **arguments) {
    const size_t samples = std::strtoull(arguments[2], nullptr, 10);
    const uint64_t patience = std::strtoull(arguments[3], nullptr, 10);
    source.seed(std::strtoul(arguments[4], nullptr, 10));
    std::vector<uint64_t> words(samples), results(samples);
    FILE *file = std::fopen(arguments[1], "rb");
    check(file && std::fread(words.data(), 8, samples, file) == samples, "the file must hold all samples");

    VerilatedContext context;
    context.randReset(2);
    Vtop top(&context);
    const auto clock = [&top] {
        top.aclk = 0;
        top.eval();
        top.aclk = 1;
        top.eval();
    };
    top.aresetn = top.s_axis_tvalid = top.m_axis_tready = 0;
    for (int i = 0; i < 4; ++i) clock();
    top.aresetn = 1;

    Pace idle{0.3}, stall{0.3};
    size_t sent = 0, received = 0;
    uint64_t clocks = 0, silence = 0, held = 0;
    bool offered = false, holds = false;
    const std::clock_t start = std::clock();
    while (received < samples) {
        if (!offered && sent < samples && idle.goes()) {
            offered = true;
            top.s_axis_tdata = words[sent];
        }
        const bool ready = stall.goes();
        top.s_axis_tvalid = offered;
        top.m_axis_tready = ready;
        top.aclk = 0;
        top.eval();
        const auto output = [&top] { return uint64_t(top.m_axis_tdata) << 8 | top.m_axis_tuser; };
        const bool valid = top.m_axis_tvalid, accepts = top.s_axis_tready;
        const uint64_t word = output();
        if (uniform() < 1.0 / 32) {
            for (int inputs = 0; inputs < 4; ++inputs) {
                top.s_axis_tvalid = inputs >> 1;
                top.m_axis_tready = inputs & 1;
                top.eval();
                check(top.m_axis_tvalid == valid && top.s_axis_tready == accepts && output() == word, "it follows");
            }
            top.s_axis_tvalid = offered;
            top.m_axis_tready = ready;
            top.eval();
        }
        check(!holds || (valid && word == held), "a stalled word must stay");
        holds = valid && !ready;
        held = word;
        if (valid && ready) results[received++] = word;
        const bool accepted = offered && accepts, busy = offered && !accepts && !valid && patience > 64;
        sent += accepted;
        offered = offered && !accepted;
        silence = accepted || (valid && ready) ? 0 : silence + 1;
        check(silence <= 2000 + patience, "samples must move");
        do {
            clock();
            ++clocks;
        } while (busy && !top.s_axis_tready && !top.m_axis_tvalid && ++silence <= 2000 + patience);
    }
    const double seconds = double(std::clock() - start) / CLOCKS_PER_SEC;
    uint64_t digest = 0;
    for (const uint64_t result : results) digest = digest * 31 + result;  // so that no result can be left out
    std::printf("%llu %.9f %llu\n", (unsigned long long)clocks, seconds, (unsigned long long)digest);
}
