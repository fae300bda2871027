// Least-squares sphere of measured points in C++ with Arrow: centre and radius with ±, and what is left, as by sphere.py. With the Arrow library that
// comes with pyarrow, where DIR is what `python3 -c "import pyarrow; print(pyarrow.get_library_dirs()[0])"` prints:
//
//     c++ -std=c++20 -O2 -o sphere sphere.cpp -I DIR/include DIR/libarrow.so.* -Wl,-rpath,DIR
#include <arrow/api.h>
#include <arrow/io/memory.h>
#include <arrow/ipc/api.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

using Table = std::shared_ptr<arrow::Table>;
constexpr int kUnknowns = 4;

// One request: its tables by name, until the line `end 0`. Empty at the end of the run.
std::map<std::string, Table> request() {
  std::map<std::string, Table> tables;
  std::string name;
  size_t size = 0;
  while (std::cin >> name >> size && name != "end") {
    std::cin.get();  // the line feed
    std::string body(size, '\0');
    std::cin.read(body.data(), static_cast<std::streamsize>(size));
    auto source = std::make_shared<arrow::io::BufferReader>(arrow::Buffer::FromString(std::move(body)));
    tables[name] = arrow::ipc::RecordBatchStreamReader::Open(source).ValueOrDie()->ToTable().ValueOrDie();
  }
  return tables;
}

void answer(const std::string& name, const Table& table) {
  auto sink = arrow::io::BufferOutputStream::Create().ValueOrDie();
  auto stream = arrow::ipc::MakeStreamWriter(sink, table->schema()).ValueOrDie();
  if (!stream->WriteTable(*table).ok() || !stream->Close().ok()) throw std::runtime_error("the answer cannot be written");
  auto body = sink->Finish().ValueOrDie();
  std::cout << name << ' ' << body->size() << '\n' << body->ToString();
}

std::vector<double> column(const Table& table, const std::string& name) {
  auto found = table->GetColumnByName(name);
  if (!found) throw std::runtime_error("expected a column " + name);
  std::vector<double> values;
  for (const auto& chunk : found->chunks())
    for (auto cell : static_cast<const arrow::DoubleArray&>(*chunk)) values.push_back(cell.value());
  return values;
}

template <typename Builder, typename T>
std::shared_ptr<arrow::Array> array(const std::vector<T>& values) {
  Builder builder;
  if (!builder.AppendValues(values).ok()) throw std::runtime_error("no memory");
  return builder.Finish().ValueOrDie();
}

using Matrix = std::array<std::array<double, kUnknowns>, kUnknowns>;

// By Gauss and Jordan with pivots.
Matrix inverse(Matrix a) {
  Matrix b{};
  for (int i = 0; i < kUnknowns; ++i) b[i][i] = 1;
  for (int i = 0; i < kUnknowns; ++i) {
    int pivot = i;
    for (int row = i; row < kUnknowns; ++row)
      if (std::abs(a[row][i]) > std::abs(a[pivot][i])) pivot = row;
    if (a[pivot][i] == 0) throw std::runtime_error("the points do not determine a sphere");
    std::swap(a[i], a[pivot]);
    std::swap(b[i], b[pivot]);
    for (int row = 0; row < kUnknowns; ++row) {
      if (row == i) continue;
      const double factor = a[row][i] / a[i][i];
      for (int k = 0; k < kUnknowns; ++k) a[row][k] -= factor * a[i][k], b[row][k] -= factor * b[i][k];
    }
    const double diagonal = a[i][i];
    for (int k = 0; k < kUnknowns; ++k) a[i][k] /= diagonal, b[i][k] /= diagonal;
  }
  return b;
}

void separate(const Table& points) {
  const std::array<std::vector<double>, 3> at{column(points, "x_mm"), column(points, "y_mm"), column(points, "z_mm")};
  const size_t count = at[0].size();
  if (count < 5) throw std::runtime_error("expected 5 points or more, found " + std::to_string(count));
  std::array<double, kUnknowns> found{0, 0, 0, 1};
  for (int axis = 0; axis < 3; ++axis)
    for (double value : at[axis]) found[axis] += value / static_cast<double>(count);
  std::vector<double> left(count);
  Matrix normal{}, covariance{};
  for (int round = 0; round < 50; ++round) {
    normal = {};
    std::array<double, kUnknowns> gradient{}, step{};
    for (size_t i = 0; i < count; ++i) {
      std::array<double, kUnknowns> row{0, 0, 0, -1};
      const double distance = std::hypot(at[0][i] - found[0], at[1][i] - found[1], at[2][i] - found[2]);
      for (int axis = 0; axis < 3; ++axis) row[axis] = (found[axis] - at[axis][i]) / distance;
      left[i] = distance - found[3];
      for (int j = 0; j < kUnknowns; ++j) {
        gradient[j] -= row[j] * left[i];
        for (int k = 0; k < kUnknowns; ++k) normal[j][k] += row[j] * row[k];
      }
    }
    covariance = inverse(normal);
    double size = 0;
    for (int j = 0; j < kUnknowns; ++j) {
      for (int k = 0; k < kUnknowns; ++k) step[j] += covariance[j][k] * gradient[k];
      found[j] += step[j];
      size = std::max(size, std::abs(step[j]));
    }
    if (size < 1e-12 * found[3]) break;
    if (round == 49) throw std::runtime_error("the fit did not settle: do the points cover a part of a sphere?");
  }
  double squares = 0;
  std::vector<double> std_mm, left_um;
  std::vector<int64_t> rows;
  for (size_t i = 0; i < count; ++i) {
    squares += left[i] * left[i];
    left_um.push_back(1e3 * left[i]);
    rows.push_back(static_cast<int64_t>(i));
  }
  for (int j = 0; j < kUnknowns; ++j) std_mm.push_back(std::sqrt(squares / static_cast<double>(count - kUnknowns) * covariance[j][j]));
  const std::vector<std::string> symbols{"centre", "centre", "centre", "radius"}, of{"x", "y", "z", "ball"}, units(kUnknowns, "mm");
  const auto text = arrow::utf8();
  const auto number = arrow::float64();
  answer("values", arrow::Table::Make(arrow::schema({arrow::field("symbol", text), arrow::field("of", text), arrow::field("value", number),
                                                     arrow::field("std", number), arrow::field("unit", text)}),
                                      {array<arrow::StringBuilder>(symbols), array<arrow::StringBuilder>(of),
                                       array<arrow::DoubleBuilder>(std::vector<double>(found.begin(), found.end())),
                                       array<arrow::DoubleBuilder>(std_mm), array<arrow::StringBuilder>(units)}));
  answer("residual", arrow::Table::Make(arrow::schema({arrow::field("row", arrow::int64()), arrow::field("residual_um", number)}),
                                        {array<arrow::Int64Builder>(rows), array<arrow::DoubleBuilder>(left_um)}));
  std::cout << "end 0\n" << std::flush;
}

int main() {
  try {
    for (auto tables = request(); !tables.empty(); tables = request()) separate(tables.at("points"));
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
}
