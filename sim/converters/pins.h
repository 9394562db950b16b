// Converters at the pins of a simulated board's front-end: they answer as their data sheets say, at once.
//
// The file of their values is text: the number of chip selects; for each of them how many bits follow the start bit of
// a command (0 for a MAX31855, which takes none), how many clocks more it samples for, its inputs, and how many values
// each input has; then these, count or frame, all inputs of the first conversion first. The last value stays.
#pragma once

#include <cstdint>
#include <cstdio>
#include <vector>

class Converter {
public:
    bool load(FILE* file) {
        size_t inputs = 0, rows = 0;
        if (std::fscanf(file, "%d %d %zu %zu", &wanted_, &wait_, &inputs, &rows) != 4 || !inputs || !rows) return false;
        values_.assign(inputs, {});
        next_.assign(inputs, 0);
        for (size_t n = 0; n < rows * inputs; ++n) {
            unsigned long value = 0;
            if (std::fscanf(file, "%lu", &value) != 1) return false;
            values_[n % inputs].push_back(uint32_t(value));
        }
        return true;
    }

    // The falling edge of CS.
    void select() {
        started_ = false;
        taken_ = waited_ = 0;
        configuration_ = 0;
        left_ = 0;
        driven_ = false;
        if (wanted_ == 0) answer(value(0), 32);
        fall();
    }

    // A rising edge of SCK.
    void rise(bool bit) {
        if (wanted_ == 0) return;
        if (!started_) {
            started_ = bit;
        } else if (taken_ < wanted_) {
            configuration_ = configuration_ << 1 | unsigned(bit);
            if (++taken_ == wanted_) {
                // SGL/DIFF, then ODD/SIGN and MSBF, or D2, D1 and D0, the first of which is not looked at.
                const unsigned channel = wanted_ == 3 ? configuration_ >> 1 & 1 : configuration_ & 3;
                answer(value(channel), 13);  // the null bit, and 12 more
            }
        } else {
            ++waited_;
        }
    }

    // A falling edge of SCK.
    void fall() {
        if (left_ == 0 || waited_ < wait_) return;
        --left_;
        driven_ = true;
        level_ = word_ >> left_ & 1;
    }

    bool level() const { return driven_ ? level_ : true; }  // pulled up

private:
    uint32_t value(size_t input) {
        const std::vector<uint32_t>& all = values_[input % values_.size()];
        size_t& place = next_[input % values_.size()];
        const uint32_t found = all[place];
        if (place + 1 < all.size()) ++place;
        return found;
    }

    void answer(uint32_t word, int bits) {
        word_ = word;
        left_ = bits;
    }

    int wanted_ = 0, wait_ = 0, taken_ = 0, waited_ = 0, left_ = 0;
    bool started_ = false, driven_ = false, level_ = true;
    uint32_t configuration_ = 0, word_ = 0;
    std::vector<std::vector<uint32_t>> values_;
    std::vector<size_t> next_;
};

class Converters {
public:
    bool load(const char* path) {
        FILE* file = std::fopen(path, "r");
        if (!file) return false;
        size_t count = 0;
        bool good = std::fscanf(file, "%zu", &count) == 1;
        converters_.resize(good ? count : 0);
        for (Converter& converter : converters_) good = good && converter.load(file);
        std::fclose(file);
        return good;
    }

    // The level of MISO behind a clock.
    bool step(uint64_t cs_n, bool sck, bool mosi) {
        bool level = true;
        for (size_t n = 0; n < converters_.size(); ++n) {
            const bool selected = !(cs_n >> n & 1);
            if (!selected) continue;
            if (cs_n_ >> n & 1) {
                converters_[n].select();
            } else if (sck && !sck_) {
                converters_[n].rise(mosi);
            } else if (!sck && sck_) {
                converters_[n].fall();
            }
            level = converters_[n].level();
        }
        cs_n_ = cs_n;
        sck_ = sck;
        return level;
    }

private:
    std::vector<Converter> converters_;
    uint64_t cs_n_ = ~uint64_t(0);
    bool sck_ = false;
};

// Only the top of a board with converters has their pins.
template <class Board>
auto exchange(Converters& converters, Board& board, int) -> decltype(void(board.sck)) {
    board.miso = converters.step(board.cs_n, board.sck, board.mosi);
}
template <class Board>
void exchange(Converters&, Board&, long) {}
