// Planners in folders: the same again, and clear words about damaged files.
#include "palanquin/control/planning/planner_file.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "palanquin/control/planning/sqp_settings_text.hpp"
#include "palanquin/control/planning/terrain_file.hpp"
#include "support/saved_planner.hpp"

namespace palanquin::planning {
namespace {

namespace fs = std::filesystem;

class PlannerFileTest : public palanquin::testing::OnSavedPlanners {
 protected:
  /// A copy of a saved planner whose file is `text`.
  std::string copy_with(const std::string& name, const std::string& text) const {
    const std::string folder = ::testing::TempDir() + "/planner-copy";
    fs::remove_all(folder);
    fs::copy(path(name), folder, fs::copy_options::recursive);
    std::ofstream(folder + "/planner") << text;
    return folder;
  }
  static std::string text_of(const std::string& folder) {
    std::stringstream text;
    text << std::ifstream(folder + "/planner").rdbuf();
    return text.str();
  }
};

TEST_F(PlannerFileTest, ASavedPlannerIsTheSameAgain) {
  for (const char* name : {"planner", "planner-observing", "planner-candidates"}) {
    const auto planner = load(name);
    const std::string text = text_of(path(name));
    const std::string folder = copy_with(name, "");
    // Policies are known to whoever built the planner; here they are those of the file.
    std::map<std::string, Policy> policies = planner->problem().policies();
    save_planner(*planner, policies, folder);
    EXPECT_EQ(text_of(folder), text);
  }
}

TEST_F(PlannerFileTest, DamagedFilesAreRefusedByLine) {
  const std::string text = text_of(path("planner"));
  const auto damaged = [&](const std::string& good, const std::string& bad) {
    std::string changed = text;
    changed.replace(changed.find(good), good.size(), bad);
    try {
      load_planner(copy_with("planner", changed));
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
    return std::string("nothing was refused");
  };
  EXPECT_NE(damaged("planner 1", "planner 9").find("version 1"), std::string::npos);
  for (const char* choice : {"hessian", "form", "globalize", "qp_settings.structured.kernels"}) {
    const std::string setting = std::string("setting ") + choice + ' ';
    const std::string line = text.substr(text.find(setting), setting.size() + 1);
    EXPECT_NE(damaged(line, setting + "7").find("must be at most"), std::string::npos) << choice;
  }
  EXPECT_NE(damaged("payload ", "payload x").find("finite number"), std::string::npos);
  EXPECT_NE(damaged("terrain plane", "terrain moon").find("one of plane"), std::string::npos);
  EXPECT_NE(damaged("setting qp ", "setting colour ").find("no setting 'colour'"),
            std::string::npos);
  EXPECT_NE(damaged("robot left", "robot someone").find("someone.position"), std::string::npos);
  EXPECT_NE(damaged("payload ", "observers -1 0 0 0 0 0 0 0\npayload ").find("not negative"),
            std::string::npos);
  EXPECT_NE(damaged("horizon ", "horizont ").find("unknown"), std::string::npos);
  EXPECT_THROW(load_planner("/nowhere"), std::runtime_error);
}

TEST(SqpSettingsText, EverySettingIsReadAsItWasWritten) {
  SqpSettings settings, read;
  settings.qp = "ldl";
  settings.globalize = false;
  settings.form = Form::Paper;
  settings.line_search.armijo = 0.123456789012345678;
  settings.qp_settings.osqp.max_iterations = 77;
  const std::string text = to_text(settings);
  for (const std::string_view statement : split(text, '\n')) {
    TextLine line(statement);
    EXPECT_EQ(line.word(), "setting");
    read_setting(line, read);
  }
  EXPECT_EQ(to_text(read), to_text(settings));
  EXPECT_NE(to_text(read), to_text(SqpSettings{}));
}

}  // namespace
}  // namespace palanquin::planning
