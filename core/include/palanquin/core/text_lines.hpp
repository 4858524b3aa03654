#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace palanquin {

/// Pieces of `text` between separators, empty ones left out.
std::vector<std::string_view> split(std::string_view text, char separator);

/// The beginning of a line for a message, in quotes: whole characters of UTF-8 that fill 80 bytes.
std::string excerpt(std::string_view line);

/// The words of a line of a text file, taken one after the other. Numbers are read by from_chars,
/// which knows no locale. Whatever is not as it should be throws std::runtime_error in words.
class TextLine {
 public:
  static constexpr int kLargestInteger = 16'777'216;  // sums of two stay within an int

  explicit TextLine(std::string_view text) : words_(split(text, ' ')) {}

  bool is_at_end() const { return next_ == words_.size(); }
  /// Throws unless all words were taken.
  void finish() const;
  std::string word();
  int integer(int lowest);
  double number();  ///< a finite one
  /// Position of the next word among `choices`.
  int choice(const std::vector<std::string_view>& choices);

 private:
  std::vector<std::string_view> words_;
  std::size_t next_ = 0;
};

/// The shortest text that reads as the same number, whatever the locale.
std::string to_text(double value);

}  // namespace palanquin
