#include "VDIMessage.h"

#include <vtkObjectFactory.h>
#include <vtkPropCollection.h>
#include <vtkRenderer.h>
#include <vtkTextProperty.h>
#include <vtkWindow.h>

#include <algorithm>
#include <cstddef>
#include <sstream>

vtkStandardNewMacro(vtkVDIMessage);

namespace {

// Sizes in pixels, for fontSize points at 72 dots per inch.
constexpr int fontSize = 16;
constexpr int smallFontSize = 12;
constexpr double letterWidth = 9.0;
constexpr double smallLetterWidth = 6.5;
constexpr double lineHeight = 18.0;
constexpr double gap = 12.0;

/// Breaks the text at blanks into lines of at most `columns` letters.
std::string wrapped(const std::string& text, std::size_t columns) {
  std::string lines;
  std::size_t column = 0;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    const bool fits = column + 1 + word.size() <= columns;
    if (column > 0) lines += fits ? ' ' : '\n';
    column = (column > 0 && fits ? column + 1 : 0) + word.size();
    lines += word;
  }
  return lines;
}

}  // namespace

vtkVDIMessage::vtkVDIMessage() {
  this->SetTextScaleModeToNone();
  this->GetPositionCoordinate()->SetCoordinateSystemToNormalizedViewport();
  this->SetPosition(0.03, 0.5);
  this->GetTextProperty()->SetFontSize(fontSize);
  this->GetTextProperty()->SetVerticalJustificationToCentered();
  this->GetTextProperty()->SetBackgroundColor(0.1, 0.1, 0.1);
  this->GetTextProperty()->SetBackgroundOpacity(0.8);
  this->SetPickable(false);
  this->SetVisibility(false);
}

void vtkVDIMessage::Show(const std::string& text, Place place) {
  this->At = place;
  this->IsNew = this->IsNew || text != this->Text || this->GetVisibility() == 0;
  if (text != this->Text) this->SetInput(text.c_str());
  this->Text = text;
  this->SetVisibility(!text.empty());
}

int vtkVDIMessage::RenderOpaqueGeometry(vtkViewport* viewport) {
  this->PutIn(viewport);
  return this->Superclass::RenderOpaqueGeometry(viewport);
}

void vtkVDIMessage::PutIn(vtkViewport* viewport) {
  auto* renderer = vtkRenderer::SafeDownCast(viewport);
  if (renderer == nullptr) return;
  int width = 0;
  int height = 0;
  renderer->GetTiledSize(&width, &height);
  if (width < 1 || height < 1) return;
  // VTK 9.1 keeps the shaders of the last drawing, which are deleted when another view is closed.
  if (this->IsNew) this->ReleaseGraphicsResources(renderer->GetVTKWindow());
  this->IsNew = false;
  const bool isSmall = this->At == Place::Bottom;
  this->GetTextProperty()->SetFontSize(isSmall ? smallFontSize : fontSize);
  this->GetTextProperty()->SetJustification(isSmall ? VTK_TEXT_CENTERED : VTK_TEXT_LEFT);
  const double scale = renderer->GetVTKWindow()->GetDPI() / 72.0;
  const double letter = (isSmall ? smallLetterWidth : letterWidth) * scale;
  const auto columns = static_cast<std::size_t>(std::max(width / letter, 20.0));
  double above = 0.0;  // pixels
  double own = 0.0;
  double all = 0.0;
  vtkPropCollection* props = renderer->GetViewProps();
  vtkCollectionSimpleIterator at;
  props->InitTraversal(at);
  while (vtkProp* prop = props->GetNextProp(at)) {
    auto* message = vtkVDIMessage::SafeDownCast(prop);
    if (message == nullptr || message->GetVisibility() == 0 || message->At != this->At) continue;
    const std::string text = wrapped(message->Text, columns);
    const auto lines = 1 + std::count(text.begin(), text.end(), '\n');
    const double itsHeight = (lineHeight * static_cast<double>(lines) + gap) * scale;
    if (message == this) {
      above = all;
      own = itsHeight;
      this->SetInput(text.c_str());
    }
    all += itsHeight;
  }
  const double edge = 0.5 * gap * scale;
  const double highest = this->At == Place::Middle ? 0.5 * (height + all)
                         : this->At == Place::Top  ? height - edge
                                                   : all + edge;
  this->SetPosition(isSmall ? 0.5 : 0.03, (highest - above - 0.5 * own) / height);
}
