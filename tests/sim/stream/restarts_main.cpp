// Streams constant samples through a core while it is reset and other constants are loaded into it, at any moment.
//
// Reads commands from the standard input, one a line:
//
//   load ADDRESS DATA ..      a load for later: register writes; they are numbered from 0
//   reset WORD ..             at once, whatever is going on; the samples of the channels from then on, in hexadecimal
//   begin LOAD COUNT          the first COUNT writes of a load
//   write LOAD                all of them, the first one until it is not refused
//   samples COUNT             until so many were taken from each channel since the last start
//   clocks COUNT              as many
//
// Writes "start RESET LOAD" when the core has been reset or has taken over a load: the numbers of the last reset and of
// the load, or -1; and "START CHANNEL DATA USER" for each result, with the number of the start that its sample came
// after. Channels and handshakes are left to chance.
#include "Vtop.h"
#include "restarts.h"
#include "verilated.h"

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <iostream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace {

constexpr int kPatience = 1000000;  // clocks in which a command must end
constexpr uint32_t kOkay = 0;

struct Bench {
    VerilatedContext context;
    Vtop core{&context, "TOP"};
    std::vector<std::vector<std::pair<uint32_t, uint32_t>>> loads;
    std::vector<uint64_t> words;
    std::vector<long> taken;
    std::deque<std::pair<long, int>> inside;  // start and channel of each sample
    uint32_t state = 2463534242u, often = 24;
    long starts = -1, resets = -1, active = -1, due = -1;
    int channel = 0;
    bool offered = false, bank = false, address_taken = false, data_taken = false, answered = false;

    uint32_t chance() {  // xorshift, Marsaglia 2003
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        return state;
    }

    void edge() {
        core.aclk = 1;
        core.eval();
        core.aclk = 0;
        core.eval();
    }

    void start() {
        ++starts;
        taken.assign(kChannels, 0);
        often = chance() & 1 ? 24 : 1;  // of 32 clocks without a sample on offer; with few, the core is often empty
        std::printf("start %ld %ld\n", resets, active);
    }

    void clock() {
        if (!offered && (chance() & 31) < often) {
            offered = true;
            channel = int(chance() % kChannels);
        }
        core.s_axis_tvalid = offered;
        core.s_axis_tdata = words[channel];
        SET_DEST(core.s_axis_tdest, channel);
        core.m_axis_tready = (chance() & 3) != 0;
        core.eval();
        if (core.bank != bank) {
            bank = core.bank;
            active = due;
            due = -1;
            start();
        }
        if (offered && core.s_axis_tready) {
            inside.emplace_back(starts, channel);
            ++taken[channel];
            offered = false;
        }
        if (core.m_axis_tvalid && core.m_axis_tready) {
            const auto [from, dest] = inside.empty() ? std::pair<long, int>{-1, -1} : inside.front();
            if (!inside.empty()) inside.pop_front();
            const int told = int(GET_DEST(core.m_axis_tdest, dest));
            std::printf("%ld %d %llx %x\n", from, told, (unsigned long long)core.m_axis_tdata, unsigned(core.m_axis_tuser));
        }
        address_taken = core.s_axil_awvalid && core.s_axil_awready;
        data_taken = core.s_axil_wvalid && core.s_axil_wready;
        answered = core.s_axil_bvalid;
        edge();
    }

    void reset() {
        core.aresetn = core.s_axis_tvalid = core.m_axis_tready = 0;
        core.s_axil_awvalid = core.s_axil_wvalid = core.s_axil_bready = core.s_axil_arvalid = core.s_axil_rready = 0;
        for (int k = 0; k < 4; ++k) edge();
        core.aresetn = 1;
        core.eval();
        offered = false;
        inside.clear();
        if (core.bank != bank) active = due;  // a swap at the last clock before, or at the first one of the reset
        bank = core.bank;
        due = -1;
        ++resets;
        start();
    }

    uint32_t write(std::pair<uint32_t, uint32_t> pair) {
        core.s_axil_awaddr = pair.first;
        core.s_axil_wdata = pair.second;
        core.s_axil_wstrb = 15;
        core.s_axil_awvalid = core.s_axil_wvalid = core.s_axil_bready = 1;
        for (int k = 0; k < kPatience; ++k) {
            core.eval();
            const uint32_t response = core.s_axil_bresp;
            clock();
            if (address_taken) core.s_axil_awvalid = 0;
            if (data_taken) core.s_axil_wvalid = 0;
            if (answered) {
                core.s_axil_bready = 0;
                return response;
            }
        }
        return fail("a write must be answered");
    }

    uint32_t fail(const char* sentence) {
        std::fprintf(stderr, "%s\n", sentence);
        std::exit(1);
    }

    void begin(long load, size_t count, bool complete) {
        const auto& writes = loads[load];
        int refused = 0;
        while (write(writes[0]) != kOkay)
            if (++refused > kPatience / 100) fail("a load must be allowed to begin");
        for (size_t k = 1; k < count; ++k) {
            if (complete && k + 1 == count) due = load;  // the bank may change before the answer is there
            if (write(writes[k]) != kOkay) fail("a write must be accepted");
        }
    }

    void samples(long count) {
        for (int k = 0;; ++k) {
            bool enough = due < 0;
            for (long found : taken) enough = enough && found >= count;
            if (enough) return;
            if (k > kPatience * 10) fail("samples must be taken");
            clock();
        }
    }

    void run(const std::string& line) {
        std::istringstream in(line);
        std::string command;
        long first = 0, second = 0;
        in >> command;
        if (command == "load") {
            loads.emplace_back();
            uint32_t address = 0, data = 0;
            while (in >> address >> data) loads.back().emplace_back(address, data);
        } else if (command == "reset") {
            words.clear();
            uint64_t word = 0;
            while (in >> std::hex >> word) words.push_back(word);
            reset();
        } else if (command == "begin" && in >> first >> second) {
            begin(first, size_t(second), false);
        } else if (command == "write" && in >> first) {
            begin(first, loads[first].size(), true);
        } else if (command == "samples" && in >> first) {
            samples(first);
        } else if (command == "clocks" && in >> first) {
            for (long k = 0; k < first; ++k) clock();
        } else {
            fail(("a command must be known, not " + line).c_str());
        }
    }
};

}  // namespace

int main() {
    Bench bench;
    bench.core.aclk = 0;
    for (std::string line; std::getline(std::cin, line);) bench.run(line);
    return 0;
}
