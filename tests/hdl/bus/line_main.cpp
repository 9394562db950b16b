// A board top in Verilator with a serial line on stdin and stdout.
//
// Reads calls: four numbers of 32 bits, count of bytes, clocks of silence to wait for, clocks at most, and one that is not 0 for a
// break of the line behind the bytes; then the bytes. Sends them without a gap, then runs until the board has been silent for so
// long. Answers with the clocks that the board was sending, the clocks of it all, the count of the bytes that it has sent, and
// these; a byte with a wrong stop bit ends the program.

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "Vtop.h"

int main(int argc, char** argv) {
    const double per_bit = atof(argv[1]);
    Vtop top;
    top.rst = 0;
    top.rx = 1;
    top.clk = 0;
    top.eval();
    uint32_t call[4];
    while (fread(call, 4, 4, stdin) == 4) {
        std::vector<uint8_t> sent(call[0]), got;
        if (fread(sent.data(), 1, call[0], stdin) != call[0]) return 2;
        const uint64_t line_clocks = uint64_t(10 * per_bit * call[0]) + 1;
        uint64_t clock = 0, quiet = 0, start = 0, first = 0, last = 0;
        bool active = false, seen = false;
        for (; clock < line_clocks || (quiet < call[1] && clock - line_clocks < call[2]); ++clock) {
            const uint64_t bit = uint64_t(clock / per_bit), byte = bit / 10, place = bit % 10;
            top.rx = 1;
            if (byte < call[0]) top.rx = place == 0 ? 0 : place == 9 ? 1 : sent[byte] >> (place - 1) & 1;
            else if (call[3] && bit < 10 * uint64_t(call[0]) + 20) top.rx = 0;
            top.clk = 1;
            top.eval();
            top.clk = 0;
            top.eval();
            quiet = top.tx && clock >= line_clocks ? quiet + 1 : 0;
            if (!active && !top.tx) {
                if (!seen) first = clock;
                active = seen = true;
                start = clock;
                got.push_back(0);
            } else if (active) {
                for (int i = 1; i < 10; ++i)
                    if (clock - start == uint64_t((i + 0.5) * per_bit)) {
                        if (i < 9) got.back() |= top.tx << (i - 1);
                        else if (!top.tx) return 3;
                        else active = false, last = clock;
                    }
            }
        }
        const uint32_t head[3] = {uint32_t(last - first), uint32_t(clock), uint32_t(got.size())};
        fwrite(head, 4, 3, stdout);
        fwrite(got.data(), 1, got.size(), stdout);
        fflush(stdout);
    }
}
