// What views say of a VDI.
#ifndef VDIMessage_h
#define VDIMessage_h

#include <vtkTextActor.h>

#include <string>

/// A text in the middle of a view's height, in lines that fit its width. Several of them in a renderer stand
/// below each other.
class vtkVDIMessage : public vtkTextActor {
 public:
  static vtkVDIMessage* New();
  vtkTypeMacro(vtkVDIMessage, vtkTextActor);

  /// Shown when it's not empty.
  void Show(const std::string& text);
  int RenderOpaqueGeometry(vtkViewport* viewport) override;

 protected:
  vtkVDIMessage();
  ~vtkVDIMessage() override = default;

 private:
  vtkVDIMessage(const vtkVDIMessage&) = delete;
  void operator=(const vtkVDIMessage&) = delete;

  void Place(vtkViewport* viewport);

  std::string Text;
};

#endif
