#include "pqVDIDisplayWidgets.h"

#include <pqCoreUtilities.h>
#include <pqPropertyWidget.h>
#include <vtkCommand.h>
#include <vtkSMProperty.h>
#include <vtkSMPropertyHelper.h>
#include <vtkSMProxy.h>
#include <QCheckBox>

#include <algorithm>
#include <array>
#include <string_view>

namespace {

/// The properties of ParaView's representations that have no effect on a VDI.
constexpr std::array<std::string_view, 24> idle{"Ambient",
                                                "AmbientColor",
                                                "Diffuse",
                                                "DiffuseColor",
                                                "Interpolation",
                                                "Luminosity",
                                                "LineWidth",
                                                "MapScalars",
                                                "MultiComponentsMapping",
                                                "NonlinearSubdivisionLevel",
                                                "Orientation",
                                                "Origin",
                                                "PointSize",
                                                "Position",
                                                "RenderLinesAsTubes",
                                                "RenderPointsAsSpheres",
                                                "Scale",
                                                "ShowTexturesOnBackface",
                                                "Specular",
                                                "SpecularColor",
                                                "SpecularPower",
                                                "Texture",
                                                "Translation",
                                                "UseNanColorForMissingArrays"};

bool isIdle(pqPropertyWidget* widget) {
  vtkSMProxy* proxy = widget->proxy();
  if (proxy == nullptr || proxy->GetXMLName() == nullptr ||
      std::string_view(proxy->GetXMLName()) != "VDIImageRepresentation")
    return false;
  vtkSMProperty* property = widget->property();
  const char* name = property != nullptr ? proxy->GetPropertyName(property) : nullptr;
  if (name == nullptr) return widget->objectName().contains("Transform");  // a group's widget
  return std::find(idle.begin(), idle.end(), name) != idle.end();
}

/// Whether this is the projection of a VDI, which ParaView would call what it calls that of the view.
bool isProjection(pqPropertyWidget* widget) {
  vtkSMProxy* proxy = widget->proxy();
  vtkSMProperty* property = widget->property();
  if (proxy == nullptr || property == nullptr || proxy->GetXMLName() == nullptr) return false;
  const std::string_view name(proxy->GetXMLName());
  return (name == "VolumetricDepthImage" || name == "RenderVDI") &&
         property == proxy->GetProperty("CameraParallelProjection");
}

}  // namespace

pqVDIHiddenDecorator::pqVDIHiddenDecorator(pqPropertyWidget* parent)
    : pqPropertyWidgetDecorator(nullptr, parent) {
  // When the representation changes, the panel asks again.
  pqCoreUtilities::connect(parent->proxy()->GetProperty("Representation"), vtkCommand::ModifiedEvent, this,
                           SIGNAL(visibilityChanged()));
}

bool pqVDIHiddenDecorator::canShowWidget(bool) const {
  return std::string_view(
             vtkSMPropertyHelper(this->parentWidget()->proxy(), "Representation").GetAsString()) != "VDI";
}

pqVDIDisplayWidgets::pqVDIDisplayWidgets(QObject* parent) : QObject(parent) {}

void pqVDIDisplayWidgets::createDefaultWidgetDecorators(pqPropertyWidget* widget) {
  if (isIdle(widget)) new pqVDIHiddenDecorator(widget);
  if (!isProjection(widget)) return;
  // Scripts know the property by the label that the XML gives it.
  if (auto* box = widget->findChild<QCheckBox*>()) box->setText(tr("Parallel Projection of the VDI"));
}
