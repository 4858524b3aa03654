#include "palanquin/core/text_lines.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <stdexcept>

namespace palanquin {

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> pieces;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(separator), text.size());
    if (end > 0) pieces.push_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return pieces;
}

std::string excerpt(std::string_view line) {
  const auto is_inside_character = [&](std::size_t at) {
    return static_cast<unsigned char>(line[at]) >> 6U == 2U;
  };
  std::size_t end = std::min<std::size_t>(line.size(), 80);
  while (end > 0 && end < line.size() && is_inside_character(end)) --end;
  return std::string("'").append(line.substr(0, end)).append("'");
}

void TextLine::finish() const {
  if (!is_at_end()) throw std::runtime_error("it has more words than it should");
}

std::string TextLine::word() {
  if (is_at_end()) throw std::runtime_error("it ends too early");
  return std::string(words_[next_++]);
}

int TextLine::integer(int lowest) {
  const std::string text = word();
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || value < lowest ||
      value > kLargestInteger)
    throw std::runtime_error("'" + text + "' must be an integer of at least " +
                             std::to_string(lowest));
  return value;
}

double TextLine::number() {
  const std::string text = word();
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value))
    throw std::runtime_error("'" + text + "' must be a finite number");
  return value;
}

int TextLine::choice(const std::vector<std::string_view>& choices) {
  const std::string text = word();
  const auto found = std::find(choices.begin(), choices.end(), text);
  if (found != choices.end()) return static_cast<int>(found - choices.begin());
  std::string known;
  for (const std::string_view c : choices) known += (known.empty() ? "" : ", ") + std::string(c);
  throw std::runtime_error("'" + text + "' must be one of " + known);
}

std::string to_text(double value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

}  // namespace palanquin
