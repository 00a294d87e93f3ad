// A page that is read from a disk may start no worker. The search then runs in a hidden frame instead.
if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    constructor(url) {
      super()
      const frame = document.createElement("iframe")
      frame.hidden = true
      this.ready = new Promise(resolve => {
        frame.addEventListener("load", () => resolve(frame.contentWindow))
      })
      frame.srcdoc = `<script>
        var told = function () {}
        postMessage = function (data) { told(data) }
        importScripts = function () {}
      <\/script><script src="${new URL(url, location)}"><\/script>`
      document.documentElement.appendChild(frame)
      this.ready.then(inside => {
        inside.told = data => this.dispatchEvent(new MessageEvent("message", { data }))
      })
    }
    postMessage(data) {
      this.ready.then(inside => inside.dispatchEvent(new inside.MessageEvent("message", { data })))
    }
    terminate() {}
  }
}
