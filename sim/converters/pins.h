// Converters at the pins of a simulated board's front-end: they answer as their data sheets say, at once.
//
// The file of their values is text: the number of chip selects; for each of them how many bits follow the start bit of
// a command (0 for a converter that takes none), how many clocks more it samples for, the bits of its answer, its inputs,
// and how many values each input has; then these, count or frame, all inputs of the first conversion first. Behind them the numbers of data
// lines from ADCs and to DACs of an I2S, and of frames; then the words of each frame, left and right of each line, of 24
// bits without a sign. The last value stays. Last, the number of DACs on an SPI.
#pragma once

#include <cstdint>
#include <cstdio>
#include <vector>

class Converter {
public:
    bool load(FILE* file) {
        size_t inputs = 0, rows = 0;
        if (std::fscanf(file, "%d %d %d %zu %zu", &wanted_, &wait_, &bits_, &inputs, &rows) != 5) return false;
        if (!inputs || !rows) return false;
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
        if (wanted_ == 0) answer(value(0), bits_);
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
                answer(value(channel), bits_);  // the null bit, and 12 more
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

    int wanted_ = 0, wait_ = 0, bits_ = 0, taken_ = 0, waited_ = 0, left_ = 0;
    bool started_ = false, driven_ = false, level_ = true;
    uint32_t configuration_ = 0, word_ = 0;
    std::vector<std::vector<uint32_t>> values_;
    std::vector<size_t> next_;
};

// Stereo converters on an I2S: LRCK is low for the left word, the highest bit comes a bit behind its edge, data changes
// where BCLK falls and is taken where it rises.
class Audio {
public:
    bool load(FILE* file) {
        size_t rows = 0;
        if (std::fscanf(file, "%zu %zu %zu", &lines_in_, &lines_out_, &rows) != 3) return false;
        words_.resize(rows * 2 * lines_in_);
        for (uint32_t& word : words_) {
            unsigned long value = 0;
            if (std::fscanf(file, "%lu", &value) != 1) return false;
            word = uint32_t(value);
        }
        got_.assign(2 * lines_out_, 0);
        return true;
    }

    // Where the words of DACs go, as text: those of a frame in a line, left and right of each.
    void record(FILE* heard) { heard_ = heard; }

    // Frames that have been taken completely.
    uint64_t frames() const { return frames_; }

    // The levels of the lines from ADCs behind a clock.
    uint64_t step(bool bclk, bool lrck, uint64_t dout) {
        if (lrck != lrck_ && !lrck) {
            if (begun_ && next_ + 2 * lines_in_ < words_.size()) next_ += 2 * lines_in_;
            begun_ = true;
        }
        if (!bclk && bclk_) place_ = lrck != lrck_ ? 0 : place_ + 1;
        if (bclk && !bclk_) take(lrck, dout);
        lrck_ = lrck;
        bclk_ = bclk;
        uint64_t levels = 0;
        for (size_t line = 0; line < lines_in_ && begun_ && place_ >= 1 && place_ <= kWidth; ++line) {
            levels |= uint64_t(words_[next_ + 2 * line + lrck] >> (kWidth - place_) & 1) << line;
        }
        return levels;
    }

private:
    static constexpr int kWidth = 24;

    void take(bool lrck, uint64_t dout) {
        slot_ = lrck == taken_lrck_ ? slot_ + 1 : 0;
        taken_lrck_ = lrck;
        if (!begun_ || slot_ < 1 || slot_ > kWidth) return;
        for (size_t line = 0; line < lines_out_; ++line) {
            uint32_t& word = got_[2 * line + lrck];
            word = (word << 1 | uint32_t(dout >> line & 1)) & ((1u << kWidth) - 1);
        }
        if (!lrck || slot_ != kWidth) return;
        ++frames_;
        if (!heard_) return;
        for (size_t n = 0; n < got_.size(); ++n) std::fprintf(heard_, n ? " %u" : "%u", got_[n]);
        std::fprintf(heard_, "\n");
    }

    size_t lines_in_ = 0, lines_out_ = 0, next_ = 0;
    int place_ = 0, slot_ = 0;
    bool bclk_ = false, lrck_ = true, taken_lrck_ = true, begun_ = false;
    uint64_t frames_ = 0;
    std::vector<uint32_t> words_, got_;
    FILE* heard_ = nullptr;
};

// DACs on an SPI: a frame of 16 bits is taken where SCK rises, the highest bit first, and counts when CS rises.
class Dacs {
public:
    // Where the words of DACs go, as text: those of a sample in a line.
    void record(FILE* heard) { heard_ = heard; }

    // Samples that all of `count` DACs have got.
    uint64_t samples() const { return samples_; }

    void step(uint64_t cs_n, size_t count, bool sck, bool mosi) {
        got_.resize(count);
        for (size_t n = 0; n < count; ++n) {
            const bool selected = !(cs_n >> n & 1);
            if (selected && (cs_n_ >> n & 1)) bits_ = 0;
            if (selected && sck && !sck_) {
                word_ = word_ << 1 | unsigned(mosi);
                ++bits_;
            }
            if (selected || (cs_n_ >> n & 1)) continue;
            if (bits_ == 16 && (word_ & 0xF000) == 0x3000) got_[n] = word_ & 0xFFF;
            if (n + 1 < count) continue;
            ++samples_;
            if (!heard_) continue;
            for (size_t k = 0; k < count; ++k) std::fprintf(heard_, k ? " %u" : "%u", got_[k]);
            std::fprintf(heard_, "\n");
        }
        cs_n_ = cs_n;
        sck_ = sck;
    }

private:
    uint64_t cs_n_ = ~uint64_t(0), samples_ = 0;
    bool sck_ = false;
    unsigned word_ = 0, bits_ = 0;
    std::vector<uint32_t> got_;
    FILE* heard_ = nullptr;
};

class Converters {
public:
    Dacs dacs;
    size_t dac_count = 0;
    Audio audio;

    bool load(const char* path) {
        FILE* file = std::fopen(path, "r");
        if (!file) return false;
        size_t count = 0;
        bool good = std::fscanf(file, "%zu", &count) == 1;
        converters_.resize(good ? count : 0);
        for (Converter& converter : converters_) good = good && converter.load(file);
        good = good && audio.load(file) && std::fscanf(file, "%zu", &dac_count) == 1;
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

template <class Board>
auto write(Converters& converters, Board& board, int) -> decltype(void(board.dac_sck)) {
    converters.dacs.step(board.dac_cs_n, converters.dac_count, board.dac_sck, board.dac_mosi);
}
template <class Board>
void write(Converters&, Board&, long) {}

template <class Board>
auto data_in(Board& board, uint64_t levels, int) -> decltype(void(board.din)) {
    board.din = levels;
}
template <class Board>
void data_in(Board&, uint64_t, long) {}

template <class Board>
auto data_out(Board& board, int) -> decltype(uint64_t(board.dout)) {
    return board.dout;
}
template <class Board>
uint64_t data_out(Board&, long) { return 0; }

template <class Board>
auto listen(Audio& audio, Board& board, int) -> decltype(void(board.bclk)) {
    data_in(board, audio.step(board.bclk, board.lrck, data_out(board, 0)), 0);
}
template <class Board>
void listen(Audio&, Board&, long) {}
